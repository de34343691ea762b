# SPDX-License-Identifier: GPL-3.0-or-later
"""The figures of the HashCache."""

from . import cells, filters, frames, times, views

FIGURES = {
    "camera_path": views.camera_path,
    "single_frame": views.single_frame,
    "time": times.to_error,
    "frames": frames.measure,
    "still": views.still,
    "returning": views.returning,
    "occupied": cells.occupied,
    "lookups": cells.lookups,
    "reconstruction": cells.reconstruction,
    "caching": cells.caching,
    "layers": views.layers,
    "filters": filters.measure,
    "methods_apart": views.methods_apart,
    "threads": views.threads,
}
