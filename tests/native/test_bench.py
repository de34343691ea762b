# SPDX-License-Identifier: GPL-3.0-or-later
"""The arithmetic of figures: goals, pairs, the fewest samples, deviations of means; what the bench writes."""

import json
import math
import os
import statistics
from pathlib import Path

import numpy as np
import pytest
from afterglow import bench, blenders, cache
from afterglow.bench import animation
from afterglow.bench import figure as figures_of
from afterglow.bench.figure import Context, Figure, Pairs, alternate, table
from afterglow.bench.foundation.kitchen import fewest
from afterglow.bench.foundation.light_passes import DIVIDED, compare, describe, light_of, resolved
from afterglow.bench.foundation.sync import staged
from afterglow.bench.hash_cache.charts import charts
from afterglow.bench.hash_cache.views import PATHS
from afterglow.bench.instant_cache import charts as instant_charts
from afterglow.bench.instant_cache import tables


@pytest.mark.parametrize(("goal", "value", "holds", "margin"), [
    ("≥ 1.2", 1.8, True, 1.5), ("≥ 1.2", 0.6, False, 0.5), ("≤ 0.012", 0.006, True, 2.0), ("≤ 0.012", 0.024, False, 0.5),
    ("= 0", 0.0, True, 1.0), ("= 0", 1e-9, False, 0.1), ("≥ 1", math.nan, False, math.nan)])
def test_goals(goal: str, value: float, holds: bool, margin: float) -> None:
    figure = Figure("f", "s", value, goal=goal).judged()
    assert figure.holds is holds
    assert figure.margin() == pytest.approx(margin, nan_ok=True)


def test_the_ratio_is_judged_where_there_is_one() -> None:
    assert Figure("f", "s", 3.0, ratio=0.5, goal="≥ 1").judged().holds is False


def test_pairs_alternate_and_have_a_median() -> None:
    order: list[str] = []
    values = iter([2.0, 1.0, 1.0, 4.0, 3.0, 1.0])
    pairs = alternate(3, lambda: (order.append("a"), next(values))[1], lambda: (order.append("b"), next(values))[1])
    assert order == ["a", "b", "b", "a", "a", "b"]
    assert pairs.ratios == [2.0, 4.0, 3.0] and pairs.median == 3.0 and pairs.spread > 0


def test_the_spread_is_that_of_a_median() -> None:
    rng = np.random.default_rng(0)
    medians, spreads = [], []
    for _ in range(400):
        pairs = Pairs(list(1 + 0.1 * rng.standard_normal(9)), [1.0] * 9)
        medians.append(pairs.median)
        spreads.append(pairs.spread)
    assert np.mean(spreads) == pytest.approx(np.std(medians), rel=0.25)


@pytest.mark.parametrize(("needed", "found"), [(1, 1), (3, 3), (4, 4), (7, 8), (16, 16), (17, None)])
def test_the_fewest_samples(needed: int, found: int | None) -> None:
    tried: list[int] = []
    assert fewest((1, 2, 3, 4, 8, 16), 4, lambda n: (tried.append(n), n >= needed)[1]) == found
    assert len(tried) == len(set(tried)) and tried[0] == 4


def test_stages_tell_what_synchronizing_took() -> None:
    stages = [[0.1, "Synchronizing object | Sun"], [0.2, "Synchronizing object | Sheet"], [0.7, "Initializing"],
              [0.9, "Updating"]]
    assert staged(stages) == pytest.approx(0.6)
    assert staged([[0.1, ""], [0.2, ""]]) is None and staged([]) is None


def test_figures_are_written_as_promised(tmp_path: Path) -> None:
    """Ten columns, booleans and null where JSON wants them; numpy's numbers and infinities come out as JSON has them."""
    figures = [Figure("a", "s", np.float32(2), "ms", "p", 4.0, 0.5, "≤ 1", spread=0.1, details={"x": np.arange(2)}).judged(),
               Figure("b", "s", math.inf, goal="≤ 1").judged(), Figure("c", "", holds=False, note="not measured: no Xvfb")]
    path = bench.write("some", figures, tmp_path, {"machine": {"cores": 2}, "versions": {"afterglow": "1"}})

    def no_constants(text: str) -> None:
        raise AssertionError(f"{text} is not JSON")

    data = json.loads(path.read_text(), parse_constant=no_constants)
    assert data["machine"] == {"cores": 2} and set(data) == {"machine", "versions", "figures"}
    assert all(list(f) == ["figure", "scene", "value", "unit", "peer", "peer_value", "ratio", "goal", "holds", "command"]
               for f in data["figures"])
    assert [f["holds"] for f in data["figures"]] == [True, False, False]
    assert data["figures"][1]["value"] is None
    details = json.loads((tmp_path / "some_details.json").read_text(), parse_constant=no_constants)
    assert details["figures"][0]["spread"] == 0.1 and details["figures"][0]["details"] == {"x": [0, 1]}
    assert (tmp_path / "some.svg").read_text().startswith("<svg")
    text = table(figures)
    assert "yes" in text and "not measured: no Xvfb" in text


def test_figures_are_chosen_by_key() -> None:
    assert bench.chosen("foundation", []) == list(bench.SETS["foundation"])
    assert bench.chosen("foundation", ["kitchen_error", "memory"]) == ["memory", "kitchen_error"]  # the order of the set
    assert bench.chosen("foundation", ["ray"]) == ["rays"]
    assert "camera_path" in bench.chosen("hash_cache", [])
    with pytest.raises(KeyError, match="no figure 'colour'"):
        bench.chosen("foundation", ["colour"])


def test_charts_of_the_instant_cache_are_drawn_from_what_was_measured() -> None:
    names = ("default", "finer", "finest")
    levels = {name: {"seconds": 2.0**i, "relmse": 0.1 / 2**i, "error": 0.001} for i, name in enumerate(names)}
    figures = [{"figure": "relMSE against path tracing, finest setting", "scene": "desk_with_chair",
                "details": {"levels": levels}}, {"figure": "other", "scene": "", "details": {}}]
    [(name, text)] = instant_charts.charts(figures).items()
    assert name == "instant_cache_error.svg" and "desk with chair" in text
    assert instant_charts.charts(figures[1:]) == {}


def test_tables_and_charts_take_the_newest_of_several_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def write(file: str, age: int, **values: float) -> None:
        path = tmp_path / file
        path.write_text(json.dumps({"figures": [{"figure": f, "scene": "s", "value": v} for f, v in values.items()]}))
        os.utime(path, (1000 - age, 1000 - age))

    monkeypatch.setattr(figures_of, "FOLDER", tmp_path)
    with pytest.raises(FileNotFoundError, match="make bench NAME=some"):
        figures_of.recorded("some")
    write("some_details.json", 2, a=1.0, b=1.0)
    write("some_a_details.json", 1, a=2.0)
    write("other_details.json", 0, a=3.0)
    assert {f["figure"]: f["value"] for f in figures_of.recorded("some")} == {"a": 2.0, "b": 1.0}
    assert [f["value"] for f in figures_of.recorded("some", [tmp_path / "other_details.json"])] == [3.0]


def test_tables_have_the_papers_numbers_beside_ours() -> None:
    stages = {kind: {"update": 0.1 * n, "fill": 0.0, "interpolate": 0.0, "filter": 0.0, "walk": 0.1, "film": 0.0}
              for n, kind in enumerate(("TIC", "IC", "IGI"), 1)}
    whitted = {"traced": [0.5, 0.4, 0.3], "own": [0.3, 0.2, 0.8]}
    figures = [{"figure": "diffuse part, TIC over IGI", "scene": "desk_with_chair", "value": 0.1, "details": {"stages": stages}},
               {"figure": "diffuse part of the first frame, IC over IGI", "scene": "desk_with_chair", "value": 0.1,
                "details": {"stages": {kind: [found] for kind, found in stages.items()}, "whitted": whitted}},
               {"figure": "whole frame, TIC over Whitted", "scene": "desk_with_chair", "value": 0.1,
                "details": {"whitted": {kind: [time / 2 for time in times] for kind, times in whitted.items()}}},
               {"figure": "pixels with FLIP above 0.1, IC against IGI", "scene": "desk_with_chair", "value": 3.5, "details": {}}]
    text = tables.tables(figures)
    for number in ("3.62", "9.33", "6.82", "18.67", "2.11", "0.07", "12.33"):
        assert number in text, (number, text)
    first, _, third, *_ = text.split("\n\nTable")
    assert "desk_with_chair  0.30  " in first and "desk_with_chair  6.67  " in third, text  # of two ways the faster


@pytest.mark.parametrize("name", ["conference_room", "pillared_hall"])
def test_animations_of_the_large_rooms_stand_beside_the_papers(name: str) -> None:
    from afterglow.bench.instant_cache import animations, paper

    assert name in animations.ONE_MOVES and animations.MOVING[name].moving and name in paper.WHOLE_MOVING
    assert "office_with_blinds" in animations.ONE_MOVES and animations.MOVING["office_with_blinds"].paper(0, 2) is None


def test_a_whole_frame_is_judged_by_the_faster_rival(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    from afterglow.bench.instant_cache import animations, watched

    monkeypatch.setattr(animations, "MOVING", {})
    monkeypatch.setattr(watched, "SETTINGS", {**watched.SETTINGS, "width": 48, "height": 32})
    [figure] = animations.whole_frame(Context(tmp_path, pairs=1))
    middles = {kind: statistics.median(times) for kind, times in figure.details["whitted"].items()}
    assert set(middles) == {animations.TRACED, animations.OWN}
    assert figure.peer_value == min(middles.values()) == middles[figure.peer]
    assert all(f"{seconds:.4f}" in figure.note for seconds in middles.values())


def test_rays_that_an_edit_can_change_are_counted_both_ways() -> None:
    """Those that cross what moved or end at a changed light are among those that count records on what moves besides."""
    from afterglow import scenes
    from afterglow.bench.instant_cache.rays import needed, saved
    from afterglow.bench.instant_cache.watched import Watched

    watched = Watched(lambda: scenes.make("desk_with_chair"), "INSTANT_CACHE", width=60, height=40, virtual_lights=32)
    before = saved(watched)
    watched.move_to(2.0)
    strict, wide = needed(watched, before, saved(watched), (1.0, 2.0))
    assert 0 < strict < wide


def test_a_reference_is_of_one_state_of_a_scene() -> None:
    from afterglow import scenes
    from afterglow.bench.instant_cache.quality import fingerprint

    one, again, moved, painted = (scenes.make("cornell_box") for _ in range(4))
    moved.objects[-1].transforms = moved.objects[-1].transforms + 0.01
    painted.materials["red"].inputs["color"] = (0.1, 0.2, 0.3)
    assert fingerprint(one) == fingerprint(again)
    assert len({fingerprint(it) for it in (one, moved, painted)}) == 3


def test_what_has_no_goal_is_not_judged() -> None:
    beside = Figure("f", "s", 3.0, "%", note="beside")
    assert beside.verdict() == "" and "MISSED" not in beside.line() and beside.holds is None
    assert Figure("f", "s", holds=False).verdict() == "NO" and Figure("f", "s", 1.0, goal="≤ 2").judged().verdict() == "yes"
    assert "NO" not in table([beside])


def test_charts_of_the_hash_cache_are_drawn_from_what_was_measured() -> None:
    """Figures 11 and 17 and table 1 of the paper: each from its own figure, none where nothing was measured."""
    quality = {"errors": {"1": 0.1, "64": 0.01}, "similarity": {"1": 0.9, "64": 0.99},
               "path_tracing": {"errors": {"64": 0.2}, "similarity": {"64": 0.8}}}
    rows = [{"resolution": r, "caching": r * r, "reconstruction": 1.0, "cells": 100 * r} for r in (0.5, 1.0)]
    table = {str(k): {"cells": 4**k, "density": 0.5**k, "data": 24 * 4**k, "map": 8 * 4**k} for k in range(3)}
    figures = [{"figure": "path-traced samples that 64 samples are worth, first frame", "details": quality},
               {"figure": "reconstruction's time over that with the fewest caching paths", "details": {"settings": {"3": rows}}},
               {"figure": "density of occupied cells at 256³", "details": {"table": table}}, {"figure": "other", "details": {}}]
    made = charts(figures)
    assert set(made) == {f"hash_cache_{n}.svg" for n in ("relmse", "ms_ssim", "caching", "updated", "density", "memory")}
    assert all(text.startswith("<svg") and text.count("<polyline") == 2 for name, text in made.items() if "updated" not in name)
    assert charts(figures[-1:]) == {}
    paths = [{"figure": f"path-traced samples that 64 samples are worth, camera path{name}", "details": quality} for name in PATHS]
    for backwards in (paths, paths[::-1]):  # which file is read first does not matter
        text = charts(backwards)["hash_cache_relmse.svg"]
        assert text.count("<polyline") == 3 and "camera path, all from the cache" in text


def test_an_animation_costs_its_first_frame_and_what_the_others_take() -> None:
    assert animation.whole([5.0, 1.0, 3.0]) == 5.0 + 99 * 2.0
    assert animation.whole([1.0] * animation.LAST) == animation.LAST


def test_one_failing_figure_does_not_end_the_bench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def unavailable(_: Context) -> list[Figure]:
        raise blenders.Unavailable("nothing here")

    def broken(_: Context) -> list[Figure]:
        raise ZeroDivisionError("by zero")

    def fine(_: Context) -> list[Figure]:
        return [Figure("fine", "s", 1.0, goal="≤ 1").judged()]

    monkeypatch.setitem(bench.SETS, "some", {"unavailable": unavailable, "broken": broken, "fine": fine})
    said: list[str] = []
    lengths: list[int] = []
    figures = bench.run("some", Context(tmp_path, say=said.append), ["unavailable", "broken", "fine"],
                        lambda f: lengths.append(len(f)))
    assert [f.holds for f in figures] == [False, False, True] and lengths == [1, 2, 3]
    assert "nothing here" in figures[0].note and "ZeroDivisionError" in figures[1].note
    assert figures[2].command == "make bench NAME=some FIGURE=fine"
    assert any(line.startswith("[2/3] broken") for line in said)


def test_the_worst_pass_is_described() -> None:
    assert "-2.00 %" in describe("DiffDir", {"DiffDir": {"ours": 0.98, "cycles": 1.0, "resolved": 0.1}})
    assert "noise" in describe("DiffDir", {"DiffDir": {"ours": 0.98, "cycles": 1.0, "resolved": 1.1}})
    assert "absent" in describe("Emit", {"Emit": "absent"})


def test_means_are_compared_beyond_three_standard_errors() -> None:
    rng = np.random.default_rng(0)
    theirs = {"combined": 1 + 1e-3 * rng.standard_normal(8), "DiffInd": 0.5 + 1e-3 * rng.standard_normal(8),
              "Emit": np.full(8, 1e-6)}
    near = {name: values * 1.0001 for name, values in theirs.items()}
    assert compare(near, theirs)[0] < 1e-3
    far = {**near, "DiffInd": theirs["DiffInd"] * 1.05}
    worst, name, _ = compare(far, theirs)
    assert name == "DiffInd" and 3 < worst < 5
    assert compare({"combined": theirs["combined"]}, theirs)[0] == math.inf
    black = {"combined": np.zeros(8)}
    assert compare(black, black)[0] == 0 and compare({"combined": np.full(8, 1e-3)}, black)[0] > 1


def test_the_cache_keeps_arrays_by_key(tmp_path, monkeypatch) -> None:
    monkeypatch.setenv("AFTERGLOW_CACHE", str(tmp_path))
    made = []

    def make() -> dict[str, np.ndarray]:
        made.append(1)
        return {"a": np.arange(3)}

    for samples in (1, 1, 2):
        np.testing.assert_array_equal(cache.arrays({"kind": "test", "samples": samples}, make)["a"], np.arange(3))
    assert len(made) == 2
    for path in tmp_path.iterdir():
        path.write_bytes(b"broken")
    cache.arrays({"kind": "test", "samples": 1}, make)
    assert len(made) == 3


def test_the_first_image_of_a_new_state_is_seen_through_noise() -> None:
    """Coarse, noisy, clipped pictures of the old and of the new state are told apart, as a viewport's screen shows them."""
    from afterglow.bench.foundation import viewport

    rng = np.random.default_rng(3)
    old = np.full((480, 800), 0.3, np.float32) + np.linspace(0.0, 0.3, 800, dtype=np.float32)
    new = old.copy()
    new[160:320, 240:400] -= 0.25
    new[280:440, 500:660] += 0.25

    def shown(state: np.ndarray, samples: int, grid: int) -> np.ndarray:
        coarse = state[::grid, ::grid]
        light = rng.gamma(0.3 * samples, 1.0 / (0.3 * samples), coarse.shape) * coarse
        picture = np.minimum(light, 1.0).repeat(grid, 0).repeat(grid, 1)[: state.shape[0], : state.shape[1]]
        return np.repeat(picture[..., None], 3, 2).astype(np.float32)

    before, after = shown(old, 16, 1), shown(new, 16, 1)
    for samples, grid in ((1, 8), (1, 4), (1, 1), (4, 1)):
        assert viewport.new_share(before, after, shown(old, samples, grid)) < 0.5
        assert viewport.new_share(before, after, shown(new, samples, grid)) > 0.5
    with pytest.raises(ValueError, match="too little"):
        viewport.new_share(before, shown(old, 16, 1), before)


@pytest.mark.parametrize("names", [("Diffuse Color", "Diffuse Direct", "Diffuse Indirect", "Emission"),
                                   ("DiffCol", "DiffDir", "DiffInd", "Emit")])
def test_a_pass_counts_as_the_light_that_it_brings(names: tuple[str, ...]) -> None:
    """Multiplied by its colour pixel by pixel, under the names of old and new Blenders."""
    color, direct, indirect, emission = (np.random.default_rng(i).random((4, 5, 3)).astype(np.float32) for i in range(4))
    combined = color * (direct + indirect) + emission
    passes = dict(zip(names, (color, direct, indirect, emission)))
    found = light_of({"combined": np.dstack([combined, combined[..., :1]]), **passes})
    assert found["combined"] == pytest.approx(found["Diffuse Direct"] + found["Diffuse Indirect"] + found["Emission"], rel=1e-6)
    assert found["Diffuse Direct" + DIVIDED] == pytest.approx(direct.mean(), rel=1e-6)
    assert "Environment" not in found and "Glossy Direct" not in found


def test_a_divided_pass_is_judged_where_its_noise_allows() -> None:
    rng = np.random.default_rng(1)

    def values(mean: float, noise: float) -> np.ndarray:
        return mean + noise * rng.standard_normal(16)

    theirs = {"combined": values(1, 1e-4), "Diffuse Direct" + DIVIDED: values(1, 1e-4)}
    assert compare({"combined": theirs["combined"], "Diffuse Direct" + DIVIDED: values(1.03, 1e-4)}, theirs)[0] > 1
    worst, _, details = compare({"combined": theirs["combined"], "Diffuse Direct" + DIVIDED: values(1.5, 0.3)}, theirs)
    assert worst < 1e-3 and resolved(details) and details["Diffuse Direct" + DIVIDED]["resolved"] > 1


def test_the_instant_cache_has_a_figure_for_every_row_of_its_table() -> None:
    assert set(bench.SETS["instant_cache"]) == {"first_frame", "animation", "whole_frame", "rays", "difference", "after_edits",
                                                "error", "viewport", "flicker", "frames", "scaling"}


def test_a_view_rests_when_its_last_far_picture_has_gone() -> None:
    from afterglow.bench.foundation.viewport import Watched
    from afterglow.bench.instant_cache.viewport import rests_after

    pictures = [np.full((4, 4, 3), value, np.float32) for value in (0.0, 0.4, 0.502, 0.49, 0.501, 0.5)]
    assert rests_after(Watched([0.0, 0.1, 0.3, 0.6, 0.9, 2.0], pictures)) == 0.6


def test_stages_of_a_cached_animation_are_told_apart() -> None:
    from afterglow import scenes
    from afterglow.bench.instant_cache.watched import METHODS, Watched

    live = {kind: Watched(lambda: scenes.make("cornell_box"), method, width=60, height=40) for kind, method in METHODS.items()}
    frames = {kind: watched.frame() for kind, watched in live.items()}
    assert frames["IGI"].filter > 0 and frames["IC"].filter == 0 and frames["IC"].fill > 0
    live["TIC"].move_to(1.0)
    assert live["TIC"].frame().fill < 0.5 * frames["TIC"].fill
    records = live["IC"].values()["records"]
    live["IC"].move_to(1.0, anew=True)
    assert live["IC"].values()["resets"] == 1 and live["IC"].values()["records"] == records
