# SPDX-License-Identifier: GPL-3.0-or-later
"""The mean of the image and of each light pass against Cycles: same file, same official Blender, equal bounces, no clamping,
no caustics. Both sides render several seeds, so that the means' standard errors are known.

A pass counts as the light that it brings to the picture: multiplied by its colour, with which Blender divides it. That mean is
linear in the samples, so that any number of them has the same expectation. The mean of the divided pass is not: at edges,
where few samples of a pixel meet the surface, it depends on their number, and rare pixels make most of its noise. Colours
are held, too, and divided passes where their noise lets one say anything."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ... import blenders, cache, images
from ..figure import Context, Figure

EFFORT = dict(seeds=8, samples=64, percent=50)
KITCHEN = dict(seeds=8, samples=64, percent=25)
ROUNDS = 4  # so often both sides render other seeds, at most: as long as noise is above the allowance
# The names of Blender 5.0 and, behind each, of those before.
PLAIN = {"combined": "combined", "Emission": "Emit", "Environment": "Env"}
GROUPS = {"Diffuse": "Diff", "Glossy": "Gloss", "Transmission": "Trans"}
PARTS = {"Direct": "Dir", "Indirect": "Ind"}
DIVIDED = ", divided"


# Black, so that Cycles' mean is its own leak through the edges (0.010 of 1000 outside; here 0.0003): tests hold it against black.
BLACK = {"sealed_box"}


def files() -> list[tuple[Path, dict[str, int]]]:
    """Every file of blend_files that is not black, and the kitchen where it is."""
    found = [path for path in sorted((blenders.project() / "blend_files").glob("*.blend")) if path.stem not in BLACK]
    try:
        found += [path for path in [blenders.shared_scenes() / "country_kitchen.blend"] if path.is_file()]
    except blenders.Unavailable:
        pass
    return [(path, KITCHEN if path.stem == "country_kitchen" else EFFORT) for path in found]


def light_of(layers: dict[str, np.ndarray]) -> dict[str, float]:
    """Means over pixels and channels: of the image, of emission and environment, of each group's colour, and of its direct and
    indirect light, as the picture has them and divided by the colour."""
    def mean(pixels: np.ndarray) -> float:
        return float(pixels[..., :3].mean(dtype=np.float64))

    result: dict[str, float] = {}
    for name, old in PLAIN.items():
        if name in layers or old in layers:
            result[name] = mean(layers[name if name in layers else old])
    for group, short in GROUPS.items():
        modern = f"{group} Color" in layers
        color = layers.get(f"{group} Color" if modern else f"{short}Col")
        if color is None:
            continue
        result[f"{group} Color"] = mean(color)
        for part, end in PARTS.items():
            pixels = layers[f"{group} {part}" if modern else short + end]
            result[f"{group} {part}"] = mean(pixels[..., :3].astype(np.float64) * color[..., :3])
            result[f"{group} {part}{DIVIDED}"] = mean(pixels)
    return result


def means(worker: blenders.Worker, engine: str, file: Path, *, first: int, seeds: int, samples: int,
          percent: int) -> dict[str, np.ndarray]:
    """Pass → (seeds,) mean over pixels and channels, of the seeds from `first` on."""
    worker.open(file, percent)
    found = []
    for seed in range(first, first + seeds):
        answer = worker.render(engine, multilayer=True, seed=seed, samples=samples, method="PATH_TRACING", accuracy=0.0)
        found.append(light_of(images.layers(answer["image"])))
        Path(answer["image"]).unlink()
    return {name: np.array([one[name] for one in found]) for name in found[0]}


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
        allowance = max(0.01 * abs(float(b.mean())), 0.001 * combined, 1e-9)  # a sealed room is black: what is allowed there is 0
        beyond, resolved = max(0.0, abs(difference) - 3 * error) / allowance, 3 * error / allowance
        details[name] = {"ours": float(a.mean()), "cycles": float(b.mean()), "standard_error": error, "of_allowance": beyond,
                         "resolved": resolved}
        if beyond > worst and (resolved <= 1 or not name.endswith(DIVIDED)):
            worst, at = beyond, name
    return worst, at, details


def describe(name: str, details: dict[str, Any]) -> str:
    """The worst pass in words, and which passes are too noisy to say whether they are within the allowance."""
    worst = details[name]
    if not isinstance(worst, dict):
        return f"pass {name} is {worst}"
    off = 100 * (worst["ours"] / worst["cycles"] - 1) if worst["cycles"] else 0.0 if worst["ours"] == 0 else float("inf")
    noisy = [pass_ for pass_, d in details.items() if isinstance(d, dict) and d["resolved"] > 1]
    divided = [pass_.removesuffix(DIVIDED) for pass_ in noisy if pass_.endswith(DIVIDED)]
    noisy = [pass_ for pass_ in noisy if not pass_.endswith(DIVIDED)]
    said = f"worst pass {name}: {off:+.2f} %"
    if noisy:
        said += f"; noise above the allowance: {', '.join(noisy)}"
    return said + (f"; divided by the colour alone: {', '.join(divided)}" if divided else "")


def resolved(details: dict[str, Any]) -> bool:
    """Whether the noise of every pass as the picture has it is below the allowance."""
    return all(d["resolved"] <= 1 for name, d in details.items() if isinstance(d, dict) and not name.endswith(DIVIDED))


def held(worker: blenders.Worker, file: Path, effort: dict[str, int]) -> Figure:
    """One file, in rounds of other seeds until the noise is below the allowance. It alone ends them, not what it hides."""
    theirs: dict[str, np.ndarray] = {}
    ours: dict[str, np.ndarray] = {}
    worst, name, details = 0.0, "combined", {}
    for number in range(ROUNDS):
        part = {"first": 1 + number * effort["seeds"], **effort}
        key = {"kind": "cycles_means", "file": cache.file_key(file), "blender": worker.version, "measure": "light", **part}
        for values, new in ((theirs, cache.arrays(key, lambda p=part: means(worker, "CYCLES", file, **p))),  # type: ignore[misc]
                            (ours, means(worker, "AFTERGLOW", file, **part))):
            for pass_, more in new.items():
                values[pass_] = np.concatenate([values.get(pass_, np.empty(0)), more])
        worst, name, details = compare(ours, theirs)
        if resolved(details):
            break
    note = f"{describe(name, details)}; {len(ours['combined'])} seeds"
    return Figure("means of image and light passes", file.stem, worst, "of what is allowed", f"Cycles {worker.version}", 1.0,
                  None, "≤ 1", note=note, details=details).judged()


def measure(context: Context) -> list[Figure]:
    figures = []
    with blenders.Worker.of_official("5.0") as worker:
        for file, effort in files():
            figures.append(held(worker, file, effort))
            context.say(f"      {file.stem}: {figures[-1].value:.2f} of what is allowed; {figures[-1].note}")
    return figures
