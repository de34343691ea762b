# SPDX-License-Identifier: GPL-3.0-or-later
"""The HashCache in files: what is saved comes back as it was, and what does not fit is refused."""

from __future__ import annotations

from typing import Any

import afterglow
import numpy as np
import pytest
from afterglow.scenes.rooms import cornell_box, furnace
from test_hash_cache import Live


def test_a_saved_cache_is_the_same_after_reload(tmp_path: Any) -> None:
    first = Live(cornell_box())
    path, again = str(tmp_path / "cells"), str(tmp_path / "again")
    first.session.save_cache(path)
    second = Live(cornell_box(), start=False)
    second.session.load_cache(path)
    second.session.save_cache(again)
    assert open(path, "rb").read() == open(again, "rb").read()
    assert np.array_equal(first.run(seed=7), second.run(seed=7))
    assert second.number("cache_resets") == 0 and second.number("cells") == first.number("cells")


def test_what_cannot_be_loaded_says_so(tmp_path: Any) -> None:
    live = Live(cornell_box(), start=False)
    path = tmp_path / "cells"
    with pytest.raises(afterglow.InvalidInput, match="remembers nothing"):
        live.session.save_cache(str(path))
    with pytest.raises(afterglow.FileError):
        live.session.load_cache(str(tmp_path / "nowhere" / "cells"))
    live.run()
    live.session.save_cache(str(path))
    with pytest.raises(afterglow.FileError):
        live.session.save_cache(str(tmp_path / "nowhere" / "cells"))
    with pytest.raises(afterglow.InvalidInput, match="another scene"):
        Live(furnace(0.5), start=False).session.load_cache(str(path))
    whole = path.read_bytes()
    for broken in (b"", whole[:100], whole[:-5], b"x" + whole[1:], whole[:-24] + bytes(24)):
        path.write_bytes(broken)
        with pytest.raises(afterglow.InvalidInput):
            live.session.load_cache(str(path))
    light = live.run(seed=3)
    assert np.isfinite(light).all() and live.number("cache_resets") == 1  # nothing was lost


OTHERS: dict[str, Any] = dict(hash_store=2, hash_length=3, hash_cell=2.0, hash_direct=True, hash_long_paths=0.5, max_bounces=7,
                              diffuse_bounces=3, glossy_bounces=2, transmission_bounces=5, transparent_max_bounces=6,
                              caustics_reflective=False, caustics_refractive=False, sample_clamp_indirect=4.0)


@pytest.mark.parametrize("name", [*OTHERS, "all"])
def test_a_loaded_cache_stays_whatever_it_was_filled_with(tmp_path: Any, name: str) -> None:
    """And is dropped where the settings say other light."""
    settings = OTHERS if name == "all" else {name: OTHERS[name]}
    first = Live(cornell_box(), **settings)
    path = str(tmp_path / "cells")
    first.session.save_cache(path)
    second = Live(cornell_box(), start=False, **settings)
    second.session.load_cache(path)
    second.run(seed=5)
    assert second.number("cache_resets") == 0
    other = Live(cornell_box(), start=False)
    other.session.load_cache(path)
    other.run(seed=5)
    assert other.number("cache_resets") == 1
