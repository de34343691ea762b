# SPDX-License-Identifier: GPL-3.0-or-later
"""numpy views of Blender's own arrays, taken from the address of an element, without a copy.

The address of element 0 and the distance to element 1 describe an array that Blender keeps in one piece. Every view is
checked at both ends and in the middle against what Python reads there; when it disagrees, `foreach_get` copies instead. A
view lives only as long as Blender leaves the mesh alone: it is passed to the native module and forgotten.
"""
from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

# sRGB's transfer curve (IEC 61966-2-1) at the 256 values of a byte
_CODES = np.arange(256) / 255.0
SRGB_TO_LINEAR = np.where(_CODES <= 0.04045, _CODES / 12.92, ((_CODES + 0.055) / 1.055) ** 2.4).astype(np.float32)


def raw_view(collection: Any, dtype: Any, width: int, offset: int = 0) -> NDArray[Any] | None:
    """(n, width) strided view of a collection's memory, None where its elements do not lie evenly in memory."""
    count, item = len(collection), np.dtype(dtype).itemsize
    if count < 2:
        return None
    first = collection[0].as_pointer()
    stride = collection[1].as_pointer() - first
    if stride < offset + width * item or stride > 256 or collection[count - 1].as_pointer() != first + (count - 1) * stride:
        return None
    memory = (ctypes.c_char * (stride * count)).from_address(first)
    return np.ndarray((count, width), dtype, memory, offset, (stride, item))


def read(collection: Any, name: str, dtype: Any, width: int, offset: int = 0, value: Callable[[Any], Any] | None = None,
         copied_as: Any = None) -> NDArray[Any]:
    """(n, width) values of property `name`: a view where `raw_view` gives one that agrees with what Python reads, else a
    copy by `foreach_get` (into `copied_as` where its type differs from the memory's)."""
    view = raw_view(collection, dtype, width, offset)
    if view is not None:
        value = value or (lambda element: getattr(element, name))
        for i in (0, len(view) // 2, len(view) - 1):
            expected = np.asarray(value(collection[i]), copied_as or dtype).ravel()
            if len(expected) != width or not np.array_equal(expected, view[i], equal_nan=expected.dtype.kind == "f"):
                break
        else:
            return view
    copy = np.empty(len(collection) * width, copied_as or dtype)
    collection.foreach_get(name, copy)
    return copy.reshape(-1, width)
