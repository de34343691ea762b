# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line: python -m afterglow accuracy | bench | render | scenes | info."""

from __future__ import annotations

import argparse
import sys


def parser() -> argparse.ArgumentParser:
    top = argparse.ArgumentParser(prog="afterglow", description="Afterglow, a render engine that remembers light.")
    commands = top.add_subparsers(dest="command", required=True, metavar="COMMAND")

    accuracy = commands.add_parser("accuracy", help="measured error against wall time of every method on a scene")
    accuracy.add_argument("file", help="a .blend file, or the name of a procedural scene")
    accuracy.add_argument("--percent", type=int, default=100, help="of the scene's resolution (100)")
    accuracy.add_argument("--samples", type=int, default=4096, help="of the whole reference (4096)")
    accuracy.add_argument("--repeats", type=int, default=2, help="renders of each setting (2)")
    accuracy.add_argument("--budget", type=float, default=60.0, help="leave out settings that take longer, seconds (60)")
    accuracy.add_argument("--method", action="append", help="only this method; may be given several times")
    accuracy.add_argument("--output", default="build/accuracy", help="folder of the JSON and the chart (build/accuracy)")

    bench = commands.add_parser("bench", help="the figures that the project promises")
    bench.add_argument("name", nargs="*", help="sets of figures, of all when none is named")
    bench.add_argument("--output", default="build/bench", help="folder of the JSON files and charts (build/bench)")
    bench.add_argument("--figure", "--only", action="append", default=[], metavar="KEY",
                       help="only the figures of this key, or of those that contain it; may be given several times")
    bench.add_argument("--list", action="store_true", help="list the keys and end")
    bench.add_argument("--pairs", type=int, default=5, help="alternating pairs of a ratio (5)")

    render = commands.add_parser("render", help="render a procedural scene to a file")
    render.add_argument("scene")
    render.add_argument("output", help="path of a .png or .exr")
    render.add_argument("--samples", type=int, default=64)
    render.add_argument("--frame", type=float, default=None)
    render.add_argument("--denoise", action="store_true")

    commands.add_parser("scenes", help="list the procedural scenes")
    commands.add_parser("info", help="versions, methods and denoisers of this build")
    return top


def main(arguments: list[str] | None = None) -> int:
    chosen = parser().parse_args(arguments)
    if chosen.command == "accuracy":
        from . import accuracy

        return accuracy.main(chosen)
    if chosen.command == "bench":
        from . import bench

        return bench.main(chosen)
    if chosen.command == "render":
        return render_scene(chosen)
    if chosen.command == "scenes":
        return list_scenes()
    return info()


def render_scene(chosen: argparse.Namespace) -> int:
    from . import Error, images, render, scenes

    try:
        result = render(scenes.make(chosen.scene), samples=chosen.samples, frame=chosen.frame, denoise=chosen.denoise)
        images.write(chosen.output, result.image)
    except (Error, KeyError, OSError) as error:
        print(f"afterglow render: {error.args[0] if error.args else error}", file=sys.stderr)
        return 2
    print(f"{chosen.output}: {result.statistics.get('samples')} samples in {result.seconds:.2f} s")
    return 0


def list_scenes() -> int:
    from . import chart, scenes

    rows = [("scene", "triangles", "lights", "frames")]
    for name in scenes.SCENES:
        scene = scenes.make(name)
        rows.append((name, f"{scene.triangle_count:,}", str(len(scene.lights)), f"{scene.frames[0]}–{scene.frames[1]}"))
    print(chart.table(rows))
    return 0


def info() -> int:
    from . import __version__, denoisers, method_descriptions, versions

    print(f"Afterglow {__version__}")
    for name, version in versions().items():
        print(f"  {name} {version}")
    for method in method_descriptions():
        print(f"method {method['id']}: {method['description']}")
    for denoiser in denoisers():
        state = f"{denoiser['version']} {denoiser['path']}" if denoiser["available"] else denoiser["reason"]
        print(f"denoiser {denoiser['id']}: {state}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
