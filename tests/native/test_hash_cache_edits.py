# SPDX-License-Identifier: GPL-3.0-or-later
"""Edits of a scene whose cells are full: the first picture after one is no worse than a fresh cache's, later ones are the
new scene's, and what an edit cannot matter to stays as it was."""

from __future__ import annotations

import functools
import math
import time
from typing import Any

import numpy as np
import pytest
from afterglow import _native
from afterglow.scenes import Camera, Description, Light, look_at, translate
from afterglow.scenes.native import Built, graph
from afterglow.scenes.rooms import diffuse
from afterglow.scenes.shapes import box, join, quad, sphere
from test_hash_cache import Live

SIZE = 64
SETTINGS: dict[str, Any] = dict(width=SIZE, height=SIZE, samples=1, hash_extra=0.0, hash_filter=False, diffuse_bounces=4)


def open_room(x: float) -> Any:
    """Two metres wide, open in front."""
    a, b, y, z = x - 1, x + 1, 1.5, 2.0
    return join(
        quad((a, -y, 0), (b, -y, 0), (b, y, 0), (a, y, 0)), quad((a, y, z), (b, y, z), (b, -y, z), (a, -y, z)),
        quad((a, y, 0), (b, y, 0), (b, y, z), (a, y, z)), quad((a, -y, 0), (a, y, 0), (a, y, z), (a, -y, z)),
        quad((b, y, 0), (b, -y, 0), (b, -y, z), (b, y, z)))


def two_rooms() -> Description:
    """Side by side, a lamp in each, seen from the front. Sixteen balls stand in the left one; the right one is red."""
    scene = Description("two rooms", Camera(look_at((0, -4.6, 1.4), (0, 0, 0.9)), math.radians(55)))
    scene.materials.update(white=diffuse((0.7, 0.7, 0.7)), red=diffuse((0.7, 0.1, 0.1)), ball=diffuse((0.6, 0.6, 0.2)))
    for name, x in (("Left", -1.1), ("Right", 1.1)):
        scene.add(name, open_room(x), "red" if name == "Right" else "white")
        scene.lights.append(Light(name, "point", translate((x, 0.2, 1.6)), 40.0, radius=0.1))
    scene.lights.append(Light("Front", "point", translate((0, -4.0, 1.2)), 10.0, radius=0.1))
    for i in range(16):
        place = (-1.8 + 0.4 * (i % 4), -0.5 + 0.4 * (i // 4), 0.12)
        scene.add(f"Ball{i}", sphere(0.12, 16, 8), "ball", transform=translate(place))
    return scene


def halve_both(b: Built) -> None:
    for lamp in ("Left", "Right"):
        b.scene.set_light(b.lights[lamp], power=20.0)


def halve_one(b: Built) -> None:
    b.scene.set_light(b.lights["Left"], power=20.0)


def switch_off(b: Built) -> None:
    b.scene.set_light(b.lights["Left"], power=0.0)


def move_ball(b: Built) -> None:
    b.scene.set_transforms(b.instances["Ball5"], translate((-0.5, -0.9, 0.12))[None])


def recolour(b: Built) -> None:
    b.scene.set_material(b.materials["red"], graph(diffuse((0.1, 0.2, 0.7))))


def recolour_balls(b: Built) -> None:
    b.scene.set_material(b.materials["ball"], graph(diffuse((0.1, 0.2, 0.7))))


def move_lamp(b: Built) -> None:
    b.scene.set_light(b.lights["Left"], transform=translate((-1.8, -0.6, 0.6)))


EDITS = dict(halve_both=halve_both, halve_one=halve_one, switch_off=switch_off, move_ball=move_ball, recolour=recolour,
             recolour_balls=recolour_balls, move_lamp=move_lamp)


def run(edit: str, seeds: int, before: int, after: int, **settings: Any) -> tuple[np.ndarray, Live]:
    """Pictures after an edit, [seed, picture, y, x, channel], of caches that `before` pictures of the old scene had filled (0: of
    fresh ones of the new scene)."""
    pictures = []
    for s in range(seeds):
        live = Live(two_rooms(), start=False, **{**SETTINGS, **settings})
        for i in range(before):
            live.run(seed=1000 * s + 500 + i)
        live.session.update(dict(seed=1000 * s))
        if not before:
            EDITS[edit](live.built)
            live.built.scene.commit()
            pictures.append([live.run(seed=1000 * s)])
        else:
            pictures.append([live.edit(lambda live=live: EDITS[edit](live.built))])
        pictures[-1] += [live.run(seed=1000 * s + 1 + i) for i in range(after - 1)]
    return np.array(pictures, np.float64), live


@functools.cache
def truth(edit: str) -> tuple[np.ndarray, np.ndarray]:
    """What a fresh cache converges to, and the pixels that no edge of an object makes noisy."""
    pictures = run(edit, 1, 0, 120)[0][0, 30:]
    mean = pictures.mean(0)
    return mean, (pictures.std(0) < 0.35 * mean + 1e-3).all(-1)


def error(pictures: np.ndarray, edit: str) -> float:
    """relMSE with the worst 0.1 % of each picture's pixels left out, a mean over pictures."""
    reference, still = truth(edit)
    exposure = 0.5 / reference.mean()
    off = (exposure**2 * (pictures - reference) ** 2 / ((exposure * reference) ** 2 + 0.01)).mean(-1)[..., still]
    off.sort()
    return float(off[..., :-max(1, off.shape[-1] // 1000)].mean())


@pytest.mark.parametrize(("edit", "first"), [("halve_both", 0.7), ("halve_one", 0.9), ("switch_off", 1.0), ("move_ball", 0.9),
                                             ("recolour", 1.0), ("recolour_balls", 0.8), ("move_lamp", 1.0)])
def test_the_first_picture_after_an_edit_is_no_worse_than_a_fresh_caches(edit: str, first: float) -> None:
    """Much better where the edit touches little, or where light changes by one factor; the ninth picture is no worse, either."""
    fresh, edited = run(edit, 3, 0, 9)[0], run(edit, 3, 16, 9)[0]
    ratios = [error(edited[:, i], edit) / error(fresh[:, i], edit) for i in (0, 8)]
    assert ratios[0] < first and ratios[1] < 1.05, ratios


@pytest.mark.slow
@pytest.mark.parametrize("edit", ["halve_one", "move_ball", "move_lamp"])
def test_old_light_fades(edit: str) -> None:
    """After 64 pictures a cache that lived through the edit has a fresh one's mean within 1 % in either half of the picture, and
    is at most half as far from it as at first."""
    fresh, edited = run(edit, 4, 0, 72)[0], run(edit, 4, 16, 72)[0]
    for columns in (slice(0, SIZE // 2), slice(SIZE // 2, SIZE)):
        off, noise = [], []
        for pictures in (slice(0, 8), slice(64, 72)):
            a, b = (p[:, pictures, :, columns].mean((1, 2, 3, 4)) for p in (fresh, edited))
            off.append(abs(b.mean() / a.mean() - 1))
            noise.append(math.hypot(a.std(ddof=1), b.std(ddof=1)) / len(a) ** 0.5 / a.mean())
        assert off[1] < 0.01 + 3 * noise[1] and off[1] < 0.5 * off[0] + 3 * noise[1], (off, noise)


def test_how_much_old_light_counts_for() -> None:
    """All of it without a doubt, none where it would be noisier than six samples, and where there is a doubt fewer samples than
    paths end in (32) however many there were; more doubt never counts for more."""
    counts, doubts = [0, 1, 5, 6, 24, 100, 5000, 2**19 - 1], np.concatenate([[0.0], np.geomspace(1e-7, 1.0, 200)])
    worth = np.array([[_native.samples_worth(n, d) for d in doubts] for n in counts])
    assert (worth[:, 0] == counts).all() and (np.diff(worth, axis=1) <= 0).all() and (np.diff(worth, axis=0) >= 0).all()
    assert worth[:, doubts > 1.01e-3].max() == 24 and (worth[:, doubts > 0.17] == 0).all()
    assert not ((worth > 0) & (worth < 6))[:, doubts > 1.01e-3].any()
    exact = 1 / (1 / np.array(counts[1:])[:, None] + doubts)
    sure = doubts <= 0.99e-3
    assert (np.abs(worth[1:, sure] - exact[:, sure]) <= 1).all()


def test_an_edit_far_away_costs_nothing() -> None:
    """What the paths say: none brings other light. The pictures go on as if nothing had been."""
    pictures = []
    for hidden in (False, True):
        description = two_rooms()
        description.materials["hidden"] = diffuse((0.5, 0.5, 0.5))
        description.add("Hidden", sphere(0.1, 8, 4), "hidden", transform=translate((0, 8, 0)))
        live = Live(description, start=False, **SETTINGS)
        for i in range(12):
            live.run(seed=i)
        live.session.update(dict(seed=50))
        if hidden:
            away = translate((0, 9, 0))[None]
            live.edit(lambda live=live, away=away: live.built.scene.set_transforms(live.built.instances["Hidden"], away))
            assert live.number("cache_resets") == 1 and live.number("cache_edits") == 1
            assert live.number("cache_ratio") == 1.0 and live.number("cache_unexplained") < 1e-3
        else:
            live.run(seed=50)
        pictures.append(np.array([live.run(seed=60 + i) for i in range(4)], np.float64))
    noise = np.abs(pictures[0][0] - pictures[0][1]).mean()
    assert np.abs(pictures[1] - pictures[0]).mean() < 0.05 * noise


def test_edits_give_the_same_image_on_any_number_of_threads() -> None:
    images = [run("halve_one", 1, 4, 3, threads=threads)[0] for threads in (1, 2)]
    assert np.array_equal(images[0], images[1])


def test_edits_faster_than_pictures() -> None:
    """Updates that are stopped before the paths were walked again lose nothing and keep nothing wrong."""
    live = Live(two_rooms(), start=False, **SETTINGS)
    for i in range(12):
        live.run(seed=i)
    for power in (30.0, 10.0, 5.0, 25.0, 20.0):
        with live.session.edit():
            live.built.scene.set_light(live.built.lights["Left"], power=power)
            live.built.scene.commit()
    live.session.wait()
    assert live.number("cache_resets") == 1
    pictures = np.array([live.run(seed=100 + i) for i in range(9)], np.float64)
    assert error(pictures[8:], "halve_one") < 1.2 * error(run("halve_one", 1, 0, 10)[0][:, 9:], "halve_one")


def plate_and_box() -> Description:
    """A room with a lamp, in it a closed box, and a plate a centimetre above its lid: the cells there hold places on either side.
    Walls of albedo 0.98 and many bounces make paths long, so that walking them again takes a while."""
    scene = Description("plate", Camera(look_at((0, -0.9, 0.6), (0, 0, -0.1)), math.radians(50)))
    scene.materials["white"] = diffuse((0.98, 0.98, 0.98))
    scene.add("Room", box((-1, -1, -1), (1, 1, 1), inward=True), "white")
    scene.add("Box", box((-0.6, -0.6, -0.99), (0.6, 0.6, 0)), "white")
    scene.add("Plate", quad((-0.5, -0.5, 0), (0.5, -0.5, 0), (0.5, 0.5, 0), (-0.5, 0.5, 0)), "white",
              transform=translate((0, 0, 0.01)))
    scene.lights = [Light("Lamp", "point", translate((0, 0, 0.7)), 10.0, radius=0.05)]
    return scene


LONG: dict[str, Any] = dict(width=32, height=32, samples=2, max_bounces=512, diffuse_bounces=512, hash_extra=0.0,
                            hash_filter=False)
INSIDE = ((0.0, -0.55, -0.2), (0.0, 0.0, -0.02))


def move_plate(b: Built) -> None:
    b.scene.set_transforms(b.instances["Plate"], translate((0, 0, -0.01))[None])


def stopped(live: Live, change: Any, seed: int, delay: float) -> bool:
    """Makes the edit and begins anew with another seed a moment later; whether the first update was still under way then."""
    with live.session.edit():
        change(live.built)
        live.built.scene.commit()
    time.sleep(delay)
    caught = live.session.progress()["stage"] == "preparing"
    live.session.update(dict(seed=seed))
    live.session.wait()
    return caught


def test_an_object_that_moved_knows_nothing_any_more() -> None:
    """From above the lid to beneath it, within its cells: there it is dark."""
    live = Live(plate_and_box(), **LONG)
    assert live.run(seed=1).min() > 0.01
    live.edit(lambda: move_plate(live.built))
    assert live.number("cache_edits") == 1 and live.look_from(*INSIDE).max() == 0.0


def test_an_update_that_is_stopped_is_made_up_for() -> None:
    """By one that knows of no edit, too; objects that moved before are not forgotten to be forgotten."""
    caught, delays = [0, 0], [0.02, 0.02]
    for attempt in range(12):
        if attempt >= 4 and min(caught) > 0:
            break
        live = Live(plate_and_box(), **LONG)
        bright = [live.run(seed=i).mean() for i in range(4)][1:]
        dimmed = stopped(live, lambda b: b.scene.set_light(b.lights["Lamp"], power=5.0), 50, delays[0])
        assert abs(live.session.read("diffuse_indirect").mean() / np.mean(bright) - 0.5) < 0.05
        assert live.number("cache_edits") == 1 and live.number("cache_unannounced") == 0
        moved = stopped(live, move_plate, 51, delays[1])
        assert live.look_from(*INSIDE).max() == 0.0 and live.number("cache_resets") == 1
        for kind, hit in enumerate((dimmed, moved)):  # a fast machine is through sooner
            caught[kind] += hit
            delays[kind] *= 1.0 if hit else 0.5
    assert min(caught) > 0, "no update was slow enough to be stopped"


def test_objects_leave_and_come_back() -> None:
    """Their cells forget; new objects that take a removed one's place know nothing of it."""
    live = Live(two_rooms(), start=False, **SETTINGS)
    for i in range(8):
        live.run(seed=i)
    ball, scene = live.built.instances["Ball5"], live.built.scene
    for place in ((0, 9, 0), (-1.4, -0.1, 0.12)) * 3:
        image = live.edit(lambda place=place: scene.set_transforms(ball, translate(place)[None]))
        assert np.isfinite(image).all() and (image >= 0).all()
    pictures = np.array([live.run(seed=100 + i) for i in range(8)], np.float64)
    fresh = Live(two_rooms(), start=False, **SETTINGS)
    expected = np.array([fresh.run(seed=200 + i) for i in range(16)], np.float64)[8:]
    assert live.number("cache_resets") == 1
    assert abs(pictures.mean() / expected.mean() - 1) < 0.02


def test_a_lamp_that_switches_with_every_frame() -> None:
    """Each state's pictures stay as good as those of caches that begin anew with every frame."""
    errors: dict[int, list[float]] = {}
    for keep in (0, 1000000):
        live = Live(two_rooms(), start=False, hash_keep=keep, **SETTINGS)
        live.run(seed=0)
        for frame in range(16):
            power = 0.0 if frame % 2 else 40.0
            live.session.update(dict(seed=10 + frame))
            image = live.edit(lambda live=live, power=power: live.built.scene.set_light(live.built.lights["Left"], power=power))
            if frame % 2:
                errors.setdefault(keep, []).append(error(image[None].astype(np.float64), "switch_off"))
    assert np.mean(errors[1000000]) < 1.1 * np.mean(errors[0]), errors


FRONT = ((0.0, -4.6, 1.4), (0.0, 0.0, 0.9))
WALL = ((-1.1, -1.0, 1.2), (-1.9, 0.5, 0.8))  # a view that sees nothing of the right room


def halves(image: np.ndarray) -> list[float]:
    """Light of the left and of the right room over what it should be with both lamps halved."""
    expected = truth("halve_both")[0]
    return [float(image[:, c].mean() / expected[:, c].mean()) for c in (slice(0, SIZE // 2), slice(SIZE // 2, SIZE))]


def test_what_was_not_seen_for_thousands_of_passes() -> None:
    """Ages are known modulo 4096 passes: cells of before the edit are gone by then, instead of passing for fresh ones."""
    live = Live(two_rooms(), start=False, **SETTINGS)
    for i in range(8):
        live.run(seed=i)
    live.look_from(*WALL)
    live.edit(lambda: halve_both(live.built))
    live.run(viewport=True, width=8, height=8, samples=2 * 4200)
    assert len(live.session.statistics()["passes_log"]) > 3500
    live.session.update(dict(viewport=False, width=SIZE, height=SIZE, samples=1))
    live.session.wait()
    assert halves(live.look_from(*FRONT)) == pytest.approx([1.0, 1.0], abs=0.15)
    assert live.number("cache_resets") == 1


def test_an_edit_long_after_a_look_and_a_look_long_after_the_edit() -> None:
    """More than 4096 passes together: ages neither wrap before the edit nor after it."""
    live = Live(two_rooms(), start=False, **SETTINGS)
    for i in range(8):
        live.run(seed=i)
    live.look_from(*WALL)

    def passes(count: int, seed: int) -> None:
        live.run(viewport=True, width=8, height=8, samples=2 * count, seed=seed)
        assert len(live.session.statistics()["passes_log"]) > 0.8 * count
        live.session.update(dict(viewport=False, width=SIZE, height=SIZE, samples=1))
        live.session.wait()

    passes(2000, 100)
    live.edit(lambda: halve_both(live.built))
    passes(2400, 101)
    assert halves(live.look_from(*FRONT)) == pytest.approx([1.0, 1.0], abs=0.15)
    assert live.number("cache_resets") == 1


def test_a_hundred_edits_out_of_sight() -> None:
    """What the edits said is kept of the last 64 alone; cells that missed more know nothing."""
    live = Live(two_rooms(), start=False, **SETTINGS)
    for i in range(8):
        live.run(seed=i)
    live.look_from(*WALL)
    sizes = []
    for edit in range(140):
        power = 20.0 + 20.0 * (edit % 2 == 0)
        live.edit(lambda power=power: [live.built.scene.set_light(live.built.lights[n], power=power) for n in ("Left", "Right")])
        sizes.append(live.number("cache_edit_bytes"))
    assert max(sizes[70:]) < 1.2 * max(sizes[:70]) and live.number("cache_edits") == 140
    assert halves(live.look_from(*FRONT)) == pytest.approx([1.0, 1.0], abs=0.15)


def test_nothing_is_kept_where_the_setting_says_so() -> None:
    _, live = run("halve_both", 1, 2, 1, hash_keep=0)
    assert live.number("cache_resets") == 2 and live.number("cache_edits") == 0


def test_a_cache_that_is_saved_after_an_edit_holds_no_old_light(tmp_path: Any) -> None:
    _, live = run("halve_both", 1, 8, 1)
    path = str(tmp_path / "cells")
    live.session.save_cache(path)
    cells = live.number("cells")
    live.session.load_cache(path)
    image = live.run(seed=77)
    assert live.number("cells") <= 1.1 * cells
    assert abs(image.mean() / truth("halve_both")[0].mean() - 1) < 0.1


def test_cells_out_of_sight_are_not_saved_as_they_were_before_an_edit(tmp_path: Any) -> None:
    """The lamps are halved while the camera sees one wall; what the other room's cells held then is in no file."""
    live = Live(two_rooms(), start=False, **SETTINGS)
    for i in range(8):
        live.run(seed=i)
    live.look_from(*WALL)
    live.edit(lambda: halve_both(live.built))
    path = str(tmp_path / "cells")
    live.session.save_cache(path)
    other = Live(two_rooms(), start=False, **SETTINGS)
    halve_both(other.built)
    other.built.scene.commit()
    other.session.load_cache(path)
    image = other.run(seed=77)
    assert other.number("cache_unannounced") == 0  # the paths were walked again before they were saved
    assert halves(image) == pytest.approx([1.0, 1.0], abs=0.15)


def test_local_view_has_a_cache_of_its_own() -> None:
    """Entering and leaving begin anew: what is hidden neither reflects nor shades, and nothing of either is kept; a view that
    stays, or another camera within, keeps its cells."""
    live = Live(two_rooms(), **SETTINGS)
    whole = live.run(seed=1).mean()
    left = [int(h) for name in ("Left", *(f"Ball{i}" for i in range(16))) for h in live.built.instances[name]]
    alone = live.run(seed=2, local_view=left)
    assert live.number("cache_resets") == 2 and alone[:, SIZE * 5 // 8:].max() == 0.0
    fresh = Live(two_rooms(), start=False, **SETTINGS)
    assert np.array_equal(alone, fresh.run(seed=2, local_view=left))
    live.run(seed=3)
    live.look_from(*WALL)
    assert live.number("cache_resets") == 2
    live.look_from(*FRONT)
    again = live.run(seed=4, local_view=None)
    assert live.number("cache_resets") == 3 and abs(again.mean() / whole - 1) < 0.2
