# SPDX-License-Identifier: GPL-3.0-or-later
"""Saved instant caches: the same image after a reload, repaired where lights changed meanwhile, refused for other scenes."""

from __future__ import annotations

from typing import Any

import afterglow
import numpy as np
import pytest
from afterglow.scenes import Description, node, translate
from afterglow.scenes.native import Built, graph
from afterglow.scenes.rooms import cornell_box, diffuse, furnace, noise_picture
from afterglow.scenes.shapes import quad, sphere

SETTINGS: dict[str, Any] = dict(method="INSTANT_CACHE", width=48, height=48, samples=1, virtual_lights=100, diffuse_bounces=3,
                                cache_accuracy=0.05)


class Live:
    def __init__(self, description: Description, start: bool = True, **settings: Any) -> None:
        self.built = Built(description)
        self.session = afterglow.Session(self.built.scene, {**SETTINGS, **settings})
        if start:
            self.run()

    def run(self, **settings: Any) -> np.ndarray:
        self.session.update(settings)
        self.session.start()
        self.session.wait()
        return self.session.read()

    def values(self) -> dict[str, float]:
        found = self.session.statistics()
        return {**found["values"], **{f"{kind}_rays": count for kind, count in found["rays"].items()}}


def room(glass: bool = False) -> Description:
    scene = cornell_box()
    scene.materials["ball"] = diffuse((0.3, 0.5, 0.7))
    if glass:
        scene.materials["ball"] = node("transparent_bsdf", color=(0.9, 0.5, 0.2))
    scene.add("Ball", sphere(0.2, 16, 8), "ball", transform=translate((0.4, -0.3, 0.9)))
    return scene


@pytest.mark.parametrize("glass", [False, True])
def test_the_image_after_a_reload_is_the_same_to_the_bit(tmp_path: Any, glass: bool) -> None:
    first = Live(room(glass))
    path, again = tmp_path / "cache", tmp_path / "again"
    first.session.save_cache(str(path))
    second = Live(room(glass), start=False)
    second.session.load_cache(str(path))
    second.session.save_cache(str(again))
    assert path.read_bytes() == again.read_bytes()
    for seed in (0, 7):
        assert np.array_equal(first.run(seed=seed), second.run(seed=seed))
    values = second.values()
    assert values["resets"] == 0 and values["records"] == first.values()["records"]
    assert values["fill_rays"] < 0.2 * first.values()["fill_rays"] and values["update_rays"] == 0


def test_short_rays_are_kept(tmp_path: Any) -> None:
    settings = dict(light_compensation=8, light_bound=4.0)
    first, path = Live(room(), **settings), str(tmp_path / "cache")
    first.session.save_cache(path)
    second = Live(room(), start=False, cache_verify=True, **settings)
    second.session.load_cache(path)
    assert np.array_equal(first.run(), second.run())
    values = second.values()
    assert values["resets"] == 0 and values["records"] == first.values()["records"] and values["verified_differing"] == 0


def test_a_cache_of_other_settings_says_why_it_goes(tmp_path: Any) -> None:
    first, path = Live(room()), str(tmp_path / "cache")
    first.session.save_cache(path)
    second = Live(room(), start=False, virtual_lights=50, light_compensation=2)
    second.session.load_cache(path)
    second.run()
    (warning,) = second.session.statistics()["warnings"]
    assert "Virtual Lights, Short Rays" in warning and second.values()["resets"] == 1
    first.session.load_cache(path)
    first.run()
    assert not first.session.statistics()["warnings"]


def painted_pane(**changes: Any) -> Description:
    """A pane that lets through what its picture says, and a board of which a half is glass."""
    scene = room()
    scene.images["spots"] = noise_picture(changes.get("spots", 8))
    coordinates = node("uv_map")
    scene.materials["pane"] = node("mix_shader", fac=node("image_texture", {"image": "spots"}, vector=coordinates),
                                   shader=diffuse((0.5, 0.5, 0.5)), shader_001=node("transparent_bsdf"))
    scene.materials["clear"] = node("transparent_bsdf")
    pane = quad((-0.9, 0.5, 0.4), (-0.2, 0.8, 0.4), (-0.2, 0.8, 1.2), (-0.9, 0.5, 1.2))
    pane.uvs = changes.get("stretch", 1.0) * pane.uvs
    scene.add("Pane", pane, "pane")
    board = quad((0.9, 0.5, 0.4), (0.2, 0.8, 0.4), (0.2, 0.8, 1.2), (0.9, 0.5, 1.2))
    board.slots = np.array(changes.get("slots", [0, 1]), np.uint16)
    scene.add("Board", board, "white", "clear")
    return scene


@pytest.mark.parametrize("change", [{"spots": 9}, {"stretch": 2.0}, {"slots": [1, 0]}])
def test_what_lets_light_through_elsewhere_is_another_scene(tmp_path: Any, change: dict[str, Any]) -> None:
    path = str(tmp_path / "cache")
    Live(painted_pane()).session.save_cache(path)
    Live(painted_pane(), start=False).session.load_cache(path)
    with pytest.raises(afterglow.InvalidInput, match="another scene"):
        Live(painted_pane(**change), start=False).session.load_cache(path)


def test_what_was_relit_meanwhile_is_repaired(tmp_path: Any) -> None:
    first = Live(room())
    path = str(tmp_path / "cache")
    first.session.save_cache(path)
    description = room()
    description.materials["red"] = diffuse((0.1, 0.1, 0.8))
    second, fresh = Live(description, start=False, cache_verify=True), Live(description)
    second.session.load_cache(path)
    image = second.run()
    values = second.values()
    assert values["resets"] == 0 and values["lights_recoloured"] > 0 and values["update_rays"] == 0
    assert values["verified_records"] == first.values()["records"] and values["verified_differing"] == 0
    assert np.abs(image - fresh.session.read()).mean() < 0.02 * image[..., :3].mean()


def test_what_cannot_be_loaded_says_so_and_nothing_is_lost(tmp_path: Any) -> None:
    live = Live(room(), start=False)
    path = tmp_path / "cache"
    with pytest.raises(afterglow.InvalidInput, match="remembers nothing"):
        live.session.save_cache(str(path))
    live.run()
    live.session.save_cache(str(path))
    with pytest.raises(afterglow.InvalidInput, match="another scene"):
        Live(furnace(0.5), start=False).session.load_cache(str(path))
    moved = room()
    moved.objects[-1].transforms = translate((0.4, -0.2, 0.9))[None]
    with pytest.raises(afterglow.InvalidInput, match="another scene"):
        Live(moved, start=False).session.load_cache(str(path))
    whole = path.read_bytes()
    nan = np.float32("nan").tobytes()
    for broken in (b"", whole[:100], whole[:-5], b"x" + whole[1:], whole[:16] + bytes([9]) + whole[17:], whole + bytes(8),
                   whole[:136] + nan + whole[140:]):
        path.write_bytes(broken)
        with pytest.raises(afterglow.InvalidInput):
            live.session.load_cache(str(path))
    assert np.isfinite(live.run(seed=3)).all() and live.values()["resets"] == 1


def test_edits_after_a_reload_are_seen(tmp_path: Any) -> None:
    first = Live(room())
    path = str(tmp_path / "cache")
    first.session.save_cache(path)
    second = Live(room(), start=False, cache_verify=True)
    second.session.load_cache(path)
    second.run()
    with second.session.edit():
        second.built.scene.set_transforms(second.built.instances["Ball"], translate((0.2, -0.3, 0.9))[None])
        second.built.scene.set_material(second.built.materials["red"], graph(diffuse((0.2, 0.5, 0.1))))
        second.built.scene.commit()
    second.session.wait()
    values = second.values()
    assert values["resets"] == 0 and values["objects_moved"] == 1 and values["verified_differing"] == 0
