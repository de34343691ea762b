# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line: what it prints and writes, and how it ends."""

import json
import os
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest


def run(library: Path, *arguments: str, cwd: Path | None = None, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-m", "afterglow", *arguments], capture_output=True, text=True, cwd=cwd,
                          env={**os.environ, "PYTHONPATH": str(library), **environment})


def test_scenes_and_info(library: Path) -> None:
    assert "cornell_box" in run(library, "scenes").stdout
    text = run(library, "info").stdout
    assert "PATH_TRACING" in text and "embree" in text


def test_render_writes_an_image(library: Path, tmp_path: Path) -> None:
    ended = run(library, "render", "cornell_box", str(tmp_path / "box.png"), "--samples", "1")
    assert ended.returncode == 0, ended.stderr
    assert (tmp_path / "box.png").read_bytes().startswith(b"\x89PNG")
    ended = run(library, "render", "no_such_scene", str(tmp_path / "box.png"))
    assert ended.returncode == 2 and "cornell_box" in ended.stderr


def test_accuracy_of_a_procedural_scene(library: Path, tmp_path: Path) -> None:
    budget = "60" if os.environ.get("AFTERGLOW_SANITIZER") else "4"  # seconds of a setting; sanitizers multiply them
    arguments = ("accuracy", "cornell_box", "--percent", "12", "--samples", "512", "--repeats", "2", "--budget", budget,
                 "--method", "PATH_TRACING", "--output", str(tmp_path / "out"))
    ended = run(library, *arguments, AFTERGLOW_CACHE=str(tmp_path / "cache"))
    assert ended.returncode == 0, ended.stderr + ended.stdout
    report = json.loads((tmp_path / "out" / "accuracy_cornell_box.json").read_text())
    points = [p for p in report["points"] if p["method"] == "PATH_TRACING"]
    assert len(points) >= 4
    for dear, cheap in zip(points[1:], points):
        # Four times the samples leave a quarter of the error.
        assert dear["error"] < cheap["error"] + 3 * (dear["error_bar"] + cheap["error_bar"])
        assert dear["error_bar"] > 0
    assert points[-1]["error"] < 0.1 * points[0]["error"]
    ElementTree.parse(tmp_path / "out" / "accuracy_cornell_box.svg")
    again = run(library, *arguments, AFTERGLOW_CACHE=str(tmp_path / "cache"))
    assert "reference:" in ended.stdout and "reference:" not in again.stdout, "the reference is kept"


def test_accuracy_names_what_is_missing(library: Path, tmp_path: Path) -> None:
    ended = run(library, "accuracy", "no_such_scene", cwd=tmp_path)
    assert ended.returncode == 2 and "cornell_box" in ended.stderr
    ended = run(library, "accuracy", "missing.blend", cwd=tmp_path)
    assert ended.returncode == 2 and "missing.blend" in ended.stderr


def test_bench_refuses_unknown_sets(library: Path) -> None:
    ended = run(library, "bench", "no_such_set")
    assert ended.returncode == 2 and "foundation" in ended.stderr


@pytest.mark.slow
def test_bench_writes_its_figures(library: Path, root: Path, tmp_path: Path) -> None:
    ended = run(library, "bench", "foundation", "--figure", "threads", "--output", str(tmp_path), cwd=root,
                AFTERGLOW_SHARED=str(tmp_path))
    data = json.loads((tmp_path / "foundation_threads.json").read_text())
    assert set(data) == {"machine", "versions", "figures"} and data["versions"]["embree"]
    assert all(f["holds"] for f in data["figures"]) and ended.returncode == 0, ended.stdout
    wanted = {"figure", "scene", "value", "unit", "peer", "peer_value", "ratio", "goal", "holds", "command"}
    assert all(wanted <= set(f) for f in data["figures"])
    ElementTree.parse(tmp_path / "foundation_threads.svg")


@pytest.mark.slow
@pytest.mark.parametrize("method", ["INSTANT_RADIOSITY", "INSTANT_CACHE", "HASH_CACHE"])
def test_accuracy_of_a_caching_method(library: Path, tmp_path: Path, method: str) -> None:
    """Five settings, each timed from an empty cache, and no error believed where the method has a bias."""
    arguments = ("accuracy", "cornell_box", "--percent", "8", "--samples", "256", "--repeats", "1", "--method", method,
                 "--output", str(tmp_path / "out"))
    ended = run(library, *arguments, AFTERGLOW_CACHE=str(tmp_path / "cache"))
    assert ended.returncode == 0, ended.stderr + ended.stdout
    points = json.loads((tmp_path / "out" / "accuracy_cornell_box.json").read_text())["points"]
    assert len(points) >= 5 and all(p["method"] == method and p["believed"] is None and p["noise"] > 0 for p in points)
    assert [p["accuracy"] for p in points] == sorted((p["accuracy"] for p in points), reverse=True)


def test_a_setting_is_cut_at_its_budget() -> None:
    import numpy as np
    from afterglow.accuracy import Point, ProceduralRenderer, Setting, measure

    def measured(samples: int, budget: float) -> list[Point]:
        renderer = ProceduralRenderer("cornell_box", 12)
        width, height = renderer.resolution
        setting = Setting("PATH_TRACING", f"{samples} spp", (("samples", samples), ("accuracy", 0.0)))
        return measure(renderer, [setting], np.ones((2, height, width, 3), np.float32), 1, budget, print)

    assert [point.setting for point in measured(4, 60.0)] == ["4 spp"]
    (cut,) = measured(1 << 16, 0.3)
    assert cut.setting == "65536 spp, cut" and cut.samples < 1 << 16


def test_the_setting_in_use_is_marked() -> None:
    from afterglow.accuracy import Point, Report, mark_in_use

    def marked(**settings: object) -> list[str]:
        report = Report("s", (8, 8), {})
        for samples in (16, 64, 256):
            believed = 1.6 / samples**0.5
            report.points.append(Point("PATH_TRACING", f"{samples} spp", 1, 1, 0, 1, 1, 1, believed, believed, samples, 0.0))
        for accuracy in (0.2, 0.05, 0.01):
            report.points.append(Point("HASH_CACHE", f"accuracy {accuracy}", 1, 1, 0, 1, 1, 1, None, accuracy, 40, accuracy))
        mark_in_use(report, dict(settings))
        return [p.setting for p in report.points if p.in_use]

    assert marked(method="AUTO", samples=200, accuracy=0.0) == ["256 spp"]
    assert marked(method="PATH_TRACING", samples=1024, accuracy=0.2) == ["64 spp"], "it stops before its samples"
    assert marked(method="PATH_TRACING", samples=20, accuracy=0.01) == ["16 spp"], "it ends before its accuracy"
    assert marked(method="HASH_CACHE", samples=1024, accuracy=0.04) == ["accuracy 0.05"]
    assert marked(method="HASH_CACHE", samples=1024, accuracy=0.0) == ["accuracy 0.01"]
    assert marked(method="INSTANT_CACHE", samples=1024, accuracy=0.1) == [] and marked() == []
