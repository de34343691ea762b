# SPDX-License-Identifier: GPL-3.0-or-later
"""Every Blender that Afterglow promises to run in: `make test-blenders` calls it.

Every test that official Blenders take part in runs in 4.2 LTS, 4.5 LTS and 5.0 (modules from PyPI), with the packaged
extension. The native module, built by the suite's own compiler and libraries, its quick tests and all tests of the
add-on, windows included, run in Debian's 4.3.2 (trixie) and 5.2.2 (sid), in roots made by debootstrap under build/roots;
those programs check the extension's manifest, too. What the windows showed at the end of each test is kept under
build/blenders. Last, pictures of the same files by all of them are compared, each with its own Cycles, for files change
their meaning. Mounts live in a namespace of their own, so nothing stays mounted. Needs root."""

from __future__ import annotations

import argparse
import os
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

import package
import venvs

ROOT = Path(__file__).resolve().parent.parent
ROOTS = Path(os.environ.get("AFTERGLOW_ROOTS") or ROOT / "build" / "roots")
PICTURES = ROOT / "build" / "blenders"
MIRROR = "http://deb.debian.org/debian"
PACKAGES = """blender python3-numpy g++ cmake ninja-build make git ccache pkg-config python3-dev pybind11-dev libtbb-dev
    libembree-dev libglm-dev libopenimageio-dev libimath-dev libopenexr-dev libfmt-dev python3-pytest python3-pytest-xdist
    python3-openimageio xvfb xauth xdotool imagemagick libgl1-mesa-dri libegl1 python3-cattr python3-requests""".split()
SUITES = ("trixie", "sid")
COMPARED = ("cornell_box", "textured_room")
# A picture's mean may be this far from the same Blender's Cycles: what Blender changed between releases moves both alike.
MEAN_TOLERANCE = 0.01


def inside(suite: str, command: str, *, quiet: bool = False) -> int:
    """Runs a shell command inside a suite's root, this project mounted at its own path; returns the exit code."""
    root = ROOTS / suite
    scenes = Path(os.environ.get("AFTERGLOW_SCENES") or ROOT.parent / "shared" / "scenes")
    shared = [str(ROOT)] + ([str(scenes.resolve())] if scenes.is_dir() else [])
    cache = Path(os.environ.get("CCACHE_DIR") or Path.home() / ".cache" / "ccache")
    cache.mkdir(parents=True, exist_ok=True)
    mounts = [f"mount -t proc proc {shlex.quote(str(root))}/proc", f"mount --rbind /dev {shlex.quote(str(root))}/dev"]
    for path in [*shared, str(cache)]:
        quoted = shlex.quote(path)
        mounts.append(f"mkdir -p {shlex.quote(str(root))}{quoted} && mount --bind {quoted} {shlex.quote(str(root))}{quoted}")
    environment = {"PATH": "/usr/sbin:/usr/bin:/sbin:/bin", "HOME": "/root", "LANG": "C.UTF-8", "CCACHE_DIR": str(cache),
                   "DEBIAN_FRONTEND": "noninteractive", "AFTERGLOW_PRESET": suite, "AFTERGLOW_SCENES": str(scenes.resolve()),
                   "AFTERGLOW_LIBRARY": str(ROOT / "build" / suite / "python")}
    assigned = " ".join(f"{name}={shlex.quote(value)}" for name, value in environment.items())
    script = f"cd {shlex.quote(str(ROOT))} && {command}"
    line = " && ".join([*mounts, f"chroot {shlex.quote(str(root))} env -i {assigned} bash -c {shlex.quote(script)}"])
    sink = subprocess.DEVNULL if quiet else None
    return subprocess.run(["unshare", "--mount", "--propagation", "private", "bash", "-c", line], stdout=sink).returncode


def make_root(suite: str) -> None:
    """Debian's suite with Blender and the build's packages; made once."""
    root = ROOTS / suite
    if (root / ".complete").is_file():
        return
    print(f"Making {root} (about 2 GB)", flush=True)
    shutil.rmtree(root, ignore_errors=True)
    root.mkdir(parents=True)
    subprocess.run(["debootstrap", "--variant=minbase", suite, str(root), MIRROR], check=True, stdout=subprocess.DEVNULL)
    # A mirror of sid may be older than its lists say that they live.
    install = ("apt-get -q -o Acquire::Check-Valid-Until=false update >/dev/null && "
               f"apt-get -qq install -y --no-install-recommends {' '.join(PACKAGES)}")
    if inside(suite, install, quiet=True):
        raise RuntimeError(f"the packages for {suite} could not be installed")
    (root / ".complete").write_text(suite + "\n")


def build(suite: str) -> None:
    command = (f"cmake -G Ninja -B build/{suite} -DCMAKE_BUILD_TYPE=Release -DPython_EXECUTABLE=/usr/bin/python3 >/dev/null "
               f"&& cmake --build build/{suite}")
    if inside(suite, command):
        raise RuntimeError(f"the module does not build on {suite}")


def test(suite: str, selection: list[str]) -> bool:
    """The native module's quick tests and all of the add-on, or the selection, in a suite's root; screenshots are kept."""
    pictures = PICTURES / suite
    shutil.rmtree(pictures, ignore_errors=True)
    pictures.mkdir(parents=True)
    pytest = f"AFTERGLOW_PICTURES={shlex.quote(str(pictures))} /usr/bin/python3 -m pytest -p no:cacheprovider"
    if selection:
        return inside(suite, f"{pytest} {' '.join(map(shlex.quote, selection))}") == 0
    native = inside(suite, f"{pytest} -m 'not slow' tests/native") == 0
    return (inside(suite, f"{pytest} tests/blender") == 0) and native


def validate(suite: str) -> bool:
    """The suite's Blender, as a program, accepts the extension's zip."""
    zip_file = shlex.quote(str(package.ensure()["extension"]))
    good = inside(suite, f"blender --command extension validate {zip_file}", quiet=True) == 0
    print(f"{suite}: the extension is {'valid' if good else 'NOT VALID'}", flush=True)
    return good


def test_official(versions: list[str]) -> bool:
    """Every test that official Blenders take part in, in these versions."""
    files = [ROOT / "tests" / "blender" / f"test_{name}.py" for name in ("package", "engine_official", "sync")]
    # The tests themselves would skip what cannot be had; here it must be there.
    package.ensure()
    for version in versions:
        venvs.ensure(version)
    env = os.environ | {"AFTERGLOW_OFFICIAL": " ".join(versions)}
    return subprocess.run([venvs.PYTHON, "-m", "pytest", *files], cwd=ROOT, env=env).returncode == 0


def render(name: str, command: str | list[str | Path], suite: str = "") -> Path | None:
    """One picture of the comparison; None when the Blender fails."""
    target = PICTURES / f"{name}.exr"
    for old in (target, target.with_name(f"{name}_cycles.exr")):
        old.unlink(missing_ok=True)
    if suite:
        inside(suite, f"{command} >{shlex.quote(str(target.with_suffix('.log')))} 2>&1")
    else:
        with target.with_suffix(".log").open("w") as log:
            subprocess.run([str(part) for part in command], stdout=log, stderr=subprocess.STDOUT)
    if not target.is_file():
        print(f"{name}: no picture, see {target.with_suffix('.log')}")
        return None
    return target


def compare(scene: Path, suites: list[str], versions: list[str]) -> bool:
    """Renders a file everywhere with the same seed and samples, and prints how far each picture is from that Blender's Cycles
    and from Debian's 3.4.1."""
    print(f"{scene.stem}, 256 samples, the same seed:", flush=True)
    script = ROOT / "tools" / "one_picture.py"
    made = package.ensure()
    pictures: dict[str, Path | None] = {}
    wrapper = ROOT / "build" / "blender"
    name = f"{scene.stem}_debian_3.4.1"
    pictures["Debian 3.4.1"] = render(name, [wrapper, "-b", scene, "--python", script, "--", PICTURES / f"{name}.exr"])
    for version in versions:
        name = f"{scene.stem}_official_{version}"
        os.environ["AFTERGLOW_LIBRARY"] = str(made["library"])
        pictures[f"official {version}"] = render(name, [venvs.ensure(version), script, "--", PICTURES / f"{name}.exr", scene])
    os.environ.pop("AFTERGLOW_LIBRARY", None)
    for suite in suites:
        name = f"{scene.stem}_debian_{suite}"
        command = [wrapper, "-b", scene, "--python", script, "--", PICTURES / f"{name}.exr"]
        line = " ".join(shlex.quote(str(part)) for part in command)
        pictures[f"Debian {suite}"] = render(name, line, suite)
    return report(pictures)


def report(pictures: dict[str, Path | None]) -> bool:
    import numpy as np
    from OpenImageIO import ImageBuf

    def pixels(path: Path) -> np.ndarray:
        return np.asarray(ImageBuf(str(path)).get_pixels(), np.float64)[..., :3]

    good, base = all(pictures.values()), None
    for name, path in pictures.items():
        cycles = path and path.with_name(path.stem + "_cycles.exr")
        if path is None or not cycles.is_file():
            good = False
            continue
        ours, theirs = pixels(path), pixels(cycles)
        base = ours if base is None else base
        beside_cycles, beside_first = ours.mean() / theirs.mean() - 1, ours.mean() / base.mean() - 1
        fits = bool(np.isfinite(ours).all()) and abs(beside_cycles) <= MEAN_TOLERANCE
        good &= fits
        print(f"{name:16} mean {ours.mean():.5f}, beside its Cycles {beside_cycles:+.3%}, beside the first {beside_first:+.3%}"
              f"{'' if fits else '  TOO FAR'}")
    return good


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--suites", nargs="*", default=list(SUITES))
    parser.add_argument("--official", nargs="*", default=list(venvs.RELEASES))
    parser.add_argument("--scene", type=Path, nargs="+", help="files whose pictures are compared",
                        default=[ROOT / "blend_files" / f"{name}.blend" for name in COMPARED])
    parser.add_argument("--only", choices=("official", "debian", "compare"), help="one of the three parts")
    parser.add_argument("tests", nargs="*", help="what pytest runs in the roots")
    arguments = parser.parse_args()
    if os.geteuid():
        print("make test-blenders: needs root, for debootstrap and chroot", file=sys.stderr)
        return 2
    PICTURES.mkdir(parents=True, exist_ok=True)
    failed = []
    if arguments.only in (None, "official"):
        failed += [] if test_official(arguments.official) else ["official Blender"]
    for suite in arguments.suites if arguments.only != "official" else []:
        make_root(suite)
        build(suite)
        if arguments.only in (None, "debian"):
            failed += [] if test(suite, arguments.tests) else [f"Debian {suite}"]
            failed += [] if validate(suite) else [f"the manifest in Debian {suite}"]
    for scene in arguments.scene if arguments.only in (None, "compare") else []:
        if not compare(scene.resolve(), arguments.suites, arguments.official):
            failed.append(f"the comparison of {scene.stem}")
    print(f"failed: {', '.join(failed)}" if failed else "all Blenders passed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
