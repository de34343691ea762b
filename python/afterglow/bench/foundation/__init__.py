# SPDX-License-Identifier: GPL-3.0-or-later
"""The figures of the path tracer and of the ground under all methods."""

from . import files, kernel, kitchen, light_passes, rays, sync, threads, viewport

FIGURES = {
    "light_passes": light_passes.measure,
    "kitchen_error": kitchen.error,
    "samples_per_second": kitchen.samples_per_second,
    "denoised_time": kitchen.denoised_time,
    "strangers": files.strangers,
    "rays": rays.measure,
    "sync": sync.measure,
    "viewport": viewport.measure,
    "kernel": kernel.measure,
    "memory": kitchen.memory,
    "threads": threads.measure,
}
