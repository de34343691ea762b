# SPDX-License-Identifier: GPL-3.0-or-later
"""The mean of the image and of each light pass against Cycles: same file, same official Blender, equal bounces, no clamping,
no caustics. Both sides render several seeds, so that the means' standard errors are known."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ... import blenders, cache, images
from ..figure import Context, Figure

SEEDS, SAMPLES, PERCENT = 8, 64, 50
KITCHEN = dict(seeds=4, samples=64, percent=25)
# The names of Blender 5.0 and, behind each, of those before.
LIGHT = {"combined": "combined", "Diffuse Direct": "DiffDir", "Diffuse Indirect": "DiffInd", "Glossy Direct": "GlossDir",
         "Glossy Indirect": "GlossInd", "Transmission Direct": "TransDir", "Transmission Indirect": "TransInd",
         "Emission": "Emit",
         "Environment": "Env"}
OLD = {old: new for new, old in LIGHT.items()}


def files() -> list[tuple[Path, dict[str, int]]]:
    """Every file of blend_files, and the kitchen where it is."""
    found: list[tuple[Path, dict[str, int]]] = [
        (path, dict(seeds=SEEDS, samples=SAMPLES, percent=PERCENT))
        for path in sorted((blenders.project() / "blend_files").glob("*.blend"))]
    try:
        kitchen = blenders.shared_scenes() / "country_kitchen.blend"
        if kitchen.is_file():
            found.append((kitchen, KITCHEN))
    except blenders.Unavailable:
        pass
    return found


def means(worker: blenders.Worker, engine: str, file: Path, seeds: int, samples: int, percent: int) -> dict[str, np.ndarray]:
    """Pass → (seeds,) mean over pixels and channels."""
    worker.open(file, percent)
    result: dict[str, list[float]] = {}
    for seed in range(seeds):
        answer = worker.render(engine, multilayer=True, seed=seed + 1, samples=samples, method="PATH_TRACING", accuracy=0.0)
        for name, pixels in images.layers(answer["image"]).items():
            name = OLD.get(name, name)
            if name in LIGHT:
                result.setdefault(name, []).append(float(pixels[..., :3].mean(dtype=np.float64)))
        Path(answer["image"]).unlink()
    return {name: np.array(values) for name, values in result.items()}


def compare(ours: dict[str, np.ndarray], theirs: dict[str, np.ndarray]) -> tuple[float, str, dict[str, Any]]:
    """(worst deviation beyond three standard errors over the allowance, its pass, all passes)."""
    worst, at, details = 0.0, "combined", {}
    combined = float(theirs["combined"].mean())
    for name, reference in theirs.items():
        if name not in ours:
            worst, at = float("inf"), name
            details[name] = "absent"
            continue
        a, b = ours[name], reference
        difference = float(a.mean() - b.mean())
        error = float(np.hypot(a.std(ddof=1) / len(a) ** 0.5, b.std(ddof=1) / len(b) ** 0.5))
        allowance = max(0.01 * abs(float(b.mean())), 0.001 * combined)
        beyond = max(0.0, abs(difference) - 3 * error) / allowance
        details[name] = {"ours": float(a.mean()), "cycles": float(b.mean()), "standard_error": error, "of_allowance": beyond,
                         "resolved": 3 * error / allowance}
        if beyond > worst:
            worst, at = beyond, name
    return worst, at, details


def describe(name: str, details: dict[str, Any]) -> str:
    """The worst pass in words, and which passes are too noisy to say whether they are within the allowance."""
    worst = details[name]
    if not isinstance(worst, dict):
        return f"pass {name} is {worst}"
    off = 100 * (worst["ours"] / worst["cycles"] - 1) if worst["cycles"] else float("inf")
    noisy = [pass_ for pass_, d in details.items() if isinstance(d, dict) and d["resolved"] > 1]
    return f"worst pass {name}: {off:+.2f} %" + (f"; noise above the allowance: {', '.join(noisy)}" if noisy else "")


def measure(context: Context) -> list[Figure]:
    figures = []
    with blenders.Worker.of_official("5.0") as worker:
        for file, effort in files():
            key = {"kind": "cycles_means", "file": cache.file_key(file), "blender": worker.version,
                   "passes": list(LIGHT), **effort}
            theirs = cache.arrays(key, lambda f=file, e=effort: means(worker, "CYCLES", f, **e))
            ours = means(worker, "AFTERGLOW", file, **effort)
            worst, name, details = compare(ours, theirs)
            figure = Figure("means of image and light passes", file.stem, worst, "of what is allowed",
                            f"Cycles {worker.version}", 1.0,
                            None, "≤ 1", note=describe(name, details), details=details).judged()
            context.say(f"      {file.stem}: {worst:.2f} of what is allowed; {figure.note}")
            figures.append(figure)
    return figures
