# SPDX-License-Identifier: GPL-3.0-or-later
"""`afterglow accuracy FILE.blend`, and the Blender that stays open behind it and behind the benchmarks."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest


@pytest.fixture(scope="module")
def worker(library: Path, root: Path):
    os.environ["AFTERGLOW_ROOT"] = str(root)
    from afterglow import blenders

    with blenders.Worker.of_debian() as made:
        assert not made.problem, made.problem
        yield made


def test_a_worker_renders_with_both_engines(worker, library: Path, blend_files: Path) -> None:
    from afterglow import images

    assert Path(worker.module).is_relative_to(library), "the module built for the distribution's Blender, where there are several"
    opened = worker.open(blend_files / "cornell_box.blend", 25)
    assert opened["resolution"] == [64, 64]
    pictures = []
    for engine in ("AFTERGLOW", "CYCLES"):
        answer = worker.render(engine, samples=16, seed=1, accuracy=0.0, method="PATH_TRACING", multilayer=True)
        layers = images.layers(answer["image"])
        short, long = {"DiffDir", "DiffInd", "Emit"}, {"Diffuse Direct", "Diffuse Indirect", "Emission"}
        assert short <= set(layers) or long <= set(layers), (engine, set(layers))
        assert layers["combined"].shape[:2] == (64, 64)
        pictures.append(layers["combined"][..., :3].mean())
    assert pictures[0] == pytest.approx(pictures[1], rel=0.1)


def test_a_failing_job_names_the_reason_and_the_worker_goes_on(worker, blend_files: Path) -> None:
    from afterglow import blenders

    with pytest.raises(blenders.WorkerError, match="no_such_setting"):
        worker.render(no_such_setting=1)
    with pytest.raises(blenders.WorkerError, match="missing"):
        worker.open(blend_files / "missing.blend")
    assert worker.job("memory")["peak"] > 1e7


@pytest.mark.slow
def test_accuracy_of_a_file(library: Path, root: Path, blend_files: Path, tmp_path: Path) -> None:
    ended = subprocess.run(
        [sys.executable, "-m", "afterglow", "accuracy", str(blend_files / "cornell_box.blend"), "--percent", "10",
         "--samples", "256",
         "--repeats", "1", "--budget", "3", "--output", str(tmp_path)], capture_output=True, text=True, cwd=root,
        env={**os.environ, "PYTHONPATH": str(library), "AFTERGLOW_CACHE": str(tmp_path / "cache")})
    assert ended.returncode == 0, ended.stdout + ended.stderr
    report = json.loads((tmp_path / "accuracy_cornell_box.json").read_text())
    errors = [p["error"] for p in report["points"] if p["method"] == "PATH_TRACING"]
    assert len(errors) >= 3 and errors[-1] < errors[0]
