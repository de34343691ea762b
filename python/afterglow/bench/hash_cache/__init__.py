# SPDX-License-Identifier: GPL-3.0-or-later
"""The figures of the HashCache."""

from . import cells, times, views

FIGURES = {
    "camera_path": views.camera_path,
    "single_frame": views.single_frame,
    "time": times.to_error,
    "still": views.still,
    "returning": views.returning,
    "occupied": cells.occupied,
    "lookups": cells.lookups,
    "reconstruction": cells.reconstruction,
    "layers": views.layers,
    "threads": views.threads,
}
