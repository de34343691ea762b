#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Runs a command with the module of a sanitizer preset: tools/sanitized.sh asan|tsan command …
# Python itself is not instrumented, so the sanitizer's runtime must be there before it starts.
set -euo pipefail
cd "$(dirname "$0")/.."
preset="$1"; shift
report="$PWD/build/$preset/report"  # pytest would keep what a dying process says
export AFTERGLOW_PRESET="$preset" AFTERGLOW_LIBRARY="$PWD/build/$preset/python" AFTERGLOW_SANITIZER="$preset"
# libstdc++ is named, too: the runtime looks for its exceptions before Python has loaded the module.
runtime() { for name in "$@"; do g++ -print-file-name="lib$name.so"; done; }
case "$preset" in
  asan)
    # Leaks of Python and numpy at exit are theirs, and many; what we leak, a test of our own counts. The order of libraries is
    # looked at by a check that does not know our own one below.
    export ASAN_OPTIONS="detect_leaks=0:abort_on_error=1:detect_odr_violation=0:verify_asan_link_order=0:log_path=$report"
    export UBSAN_OPTIONS="print_stacktrace=1:halt_on_error=1:log_path=$report"
    libraries=$(runtime asan ubsan stdc++) ;;
  tsan)
    export TSAN_OPTIONS="suppressions=$PWD/tests/tsan.supp:halt_on_error=1:ignore_noninstrumented_modules=1:history_size=7:log_path=$report"
    libraries=$(runtime tsan stdc++) ;;
  *) echo "tools/sanitized.sh: asan or tsan" >&2; exit 2 ;;
esac
shallow="$PWD/build/$preset/shallow_dlopen.so"
gcc -shared -fPIC -O1 -o "$shallow" tests/cpp/shallow_dlopen.c
rm -f "$report".*
LD_PRELOAD="$shallow $(echo $libraries)" "$@" || code=$?
cat "$report".* 2>/dev/null || true
exit "${code:-0}"
