# SPDX-License-Identifier: GPL-3.0-or-later
"""The figures of the path tracer and of the ground under all methods."""

from . import files, kernel, kitchen, light_passes, rays, sync, threads, viewport

# Those that need a quiet machine first, means of pictures last.
FIGURES = {
    "samples_per_second": kitchen.samples_per_second,
    "denoised_time": kitchen.denoised_time,
    "sync": sync.measure,
    "rays": rays.measure,
    "viewport": viewport.measure,
    "kernel": kernel.measure,
    "memory": kitchen.memory,
    "threads": threads.measure,
    "kitchen_error": kitchen.error,
    "strangers": files.strangers,
    "light_passes": light_passes.measure,
}
