#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Installs from Debian's packages what a task needs and does not find. Nothing is missing: it ends within a tenth of a
# second and asks for no rights. Usage: tools/setup.sh build|demo|test|package|blenders|format …
set -euo pipefail

build="g++ cmake ninja-build ccache pkg-config python3 python3-dev python3-numpy pybind11-dev libtbb-dev libembree-dev
  libglm-dev libopenimageio-dev libimath-dev libopenexr-dev libfmt-dev"
demo="blender python3-numpy"
package="patchelf binutils ca-certificates python3-venv python3-pip"
test="python3-pytest python3-pytest-xdist python3-openimageio xvfb xauth xdotool imagemagick libgl1-mesa-dri libegl1
  valgrind"
blenders="debootstrap xvfb imagemagick xdotool"
format="clang-format"

wanted=""
for task in "$@"; do
  case "$task" in
    build) wanted+=" $build" ;;
    demo) wanted+=" $build $demo" ;;
    test) wanted+=" $build $demo $package $test" ;;
    package) wanted+=" $build $package" ;;
    blenders) wanted+=" $build $demo $package $test $blenders" ;;
    format) wanted+=" $format" ;;
    *) echo "tools/setup.sh: unknown task '$task'" >&2; exit 2 ;;
  esac
done

if ! command -v dpkg-query >/dev/null || ! command -v apt-get >/dev/null; then
  echo "tools/setup.sh: not a Debian system; going on with what is installed. Needed are:$(echo $wanted | fmt -w 110)" >&2
  exit 0
fi

missing=""
installed=$(dpkg-query -W -f '${db:Status-Abbrev}${Package}\n' | sed -n 's/^ii *//p')
for package_name in $wanted; do
  grep -qxF -- "$package_name" <<<"$installed" || missing+=" $package_name"
done
missing=$(echo $missing | tr ' ' '\n' | sort -u | tr '\n' ' ')
[ -n "${missing// /}" ] || exit 0

as_root=""
if [ "$(id -u)" != 0 ]; then
  command -v sudo >/dev/null || { echo "tools/setup.sh: as root, please: apt-get install $missing" >&2; exit 1; }
  as_root="sudo"
fi
echo "Installing from Debian: $missing"
apt="$as_root env DEBIAN_FRONTEND=noninteractive apt-get -q -o DPkg::Lock::Timeout=600"
# A third party's list that cannot be read must not stop what Debian itself can give.
$apt update >/dev/null || echo "tools/setup.sh: some package lists could not be read; going on" >&2
$apt install -y --no-install-recommends $missing >/tmp/afterglow-setup.$$ 2>&1 || {
  tail -n 30 /tmp/afterglow-setup.$$ >&2
  echo "tools/setup.sh: apt-get install failed" >&2
  exit 1
}
rm -f /tmp/afterglow-setup.$$
