# SPDX-License-Identifier: GPL-3.0-or-later
"""Properties of objects, instancers, view layers and worlds that shaders ask for by name, and an object's random number."""
from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

WORD = 0xFFFFFFFF


@dataclass(frozen=True)
class Owner:
    """The object that shows a material, and what instances it; only for as long as one step of the depsgraph's walk."""

    ob: Any = None
    parent: Any = None

    @property
    def key(self) -> tuple[int, int]:
        """Addresses that stay."""
        return tuple(thing.original.as_pointer() if thing is not None else 0 for thing in (self.ob, self.parent))  # type: ignore[return-value]

    def places(self, instancer: bool) -> list[Any]:
        """Where a property is looked for, in this order. instancer: what made the instance comes first."""
        places = [self.parent] if instancer and self.parent is not None else []
        return [*places, self.ob, getattr(self.ob, "data", None)]


NOBODY = Owner()


def property_of(places: Iterable[Any], name: str) -> tuple[float, ...] | None:
    """The first property of that name, custom ones before Blender's own paths, as a colour and alpha."""
    for place in places:
        for ask in (lambda: place[name], lambda: place.path_resolve(name)):  # noqa: B023  asked at once
            try:
                found = as_color(ask())
            except (KeyError, TypeError, ValueError, AttributeError):
                continue
            if found is not None:
                return found
    return None


def as_color(value: Any) -> tuple[float, ...] | None:
    if isinstance(value, (bool, int, float)):
        return (float(value),) * 3 + (1.0,)
    if isinstance(value, str) or not hasattr(value, "__len__") or not 1 <= len(value) <= 4:
        return None
    numbers = tuple(float(number) for number in value)
    if len(numbers) == 1:
        return numbers * 3 + (1.0,)
    return (numbers + (0.0, 0.0))[:3] + (1.0,) if len(numbers) < 4 else numbers


def _mixed(a: int, b: int) -> int:
    """Jenkins' lookup3 of two words, by which Cycles numbers objects."""
    def turned(x: int, k: int) -> int:
        return (x << k | x >> (32 - k)) & WORD
    start = (0xDEADBEEF + (2 << 2) + 13) & WORD
    x, y, z = (start + a) & WORD, (start + b) & WORD, start
    for bits in ((14, 11, 25), (16, 4, 14)):
        z = ((z ^ y) - turned(y, bits[0])) & WORD
        x = ((x ^ z) - turned(z, bits[1])) & WORD
        y = ((y ^ x) - turned(x, bits[2])) & WORD
    return ((z ^ y) - turned(y, 24)) & WORD


@lru_cache(maxsize=1 << 16)
def random_of_name(name: str) -> int:
    """The random number, 32 bits, of an object that is no instance."""
    number = 0
    for byte in name.encode():
        number = (number * 37 + (byte - 256 if byte > 127 else byte)) & WORD
    return _mixed(number, 0)
