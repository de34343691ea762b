# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders of the Country Kitchen (Jay-Artist, CC-BY 3.0) with caches alive between them, inside the official Blender, and what
the path tracer says of the same views."""

from __future__ import annotations

import json
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ... import blenders, cache, metrics
from ..foundation.kitchen import PERCENT, scene

INSIDE = Path(__file__).with_name("inside.py")
SIZE = (640, 360)
SMALL = (192, 108)  # of long walks
STRIDE = 0.4  # metres to either side
BOUNCES: dict[str, Any] = {"max_bounces": 12, "diffuse_bounces": 12, "glossy_bounces": 12, "transmission_bounces": 12,
                           "sample_clamp_direct": 0.0, "sample_clamp_indirect": 0.0, "caustics_reflective": False,
                           "caustics_refractive": False}
Images = dict[str, NDArray[np.float32]]


def render(at: float | None, seed: int, samples: int, keep: str | None = None, method: str = "HASH_CACHE", **settings: Any
           ) -> dict[str, Any]:
    """A job for `run`: the file's view (None) or one on the walk."""
    return {"do": "render", "at": at, "keep": keep, "settings": {"method": method, "seed": seed, "samples": samples, **settings}}


def run(jobs: list[dict[str, Any]], size: tuple[int, int] = SIZE) -> tuple[list[dict[str, Any]], Images]:
    """All jobs on one native scene; their answers, the first being that of reading the file, and the images they kept."""
    file, _ = scene()
    with blenders.Worker.of_official("5.0") as worker, tempfile.TemporaryDirectory() as folder:
        worker.open(file, PERCENT)
        given, made = Path(folder) / "jobs.json", Path(folder) / "answers.npz"
        given.write_text(json.dumps({"size": size, "stride": STRIDE, "settings": BOUNCES, "jobs": jobs}))
        worker.job("script", file=str(INSIDE), arguments=[str(given), str(made)])
        with np.load(made) as kept:
            images = {name: kept[name] for name in kept.files if name != "answers"}
            return json.loads(str(kept["answers"])), images


def halves(at: float | None, samples: int, size: tuple[int, int]) -> list[NDArray[np.float32]]:
    """Two independent path-traced references of a view, kept by key."""
    file, _ = scene()
    key = {"kind": "walk_reference", "file": cache.file_key(file), "at": at, "stride": STRIDE, "samples": samples, "size": size,
           "bounces": BOUNCES}

    def make() -> Images:
        jobs = [render(at, 1000 + k, samples, f"half{k}", "PATH_TRACING") for k in range(2)]
        return run(jobs, size)[1]

    kept = cache.arrays(key, make)
    return [kept["half0"], kept["half1"]]


@dataclass
class Cost:
    """c of the path tracer's error c / N: the mean of error × N over the counts; errors and MS-SSIM by samples a pixel."""

    c: float
    errors: dict[int, float]
    similarity: dict[int, float]


def path_tracing_cost(at: float | None, truth: list[NDArray[np.float32]], size: tuple[int, int]) -> Cost:
    counts = (64, 256)
    _, images = run([render(at, 7, n, f"n{n}", "PATH_TRACING") for n in counts], size)
    errors = {n: metrics.halves_relmse(images[f"n{n}"], truth).value for n in counts}
    mean = np.mean(truth, axis=0)
    return Cost(float(np.mean([error * n for n, error in errors.items()])), errors,
                {n: metrics.ms_ssim(images[f"n{n}"], mean) for n in counts})
