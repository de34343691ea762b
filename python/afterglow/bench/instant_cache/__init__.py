# SPDX-License-Identifier: GPL-3.0-or-later
"""The figures of instant radiosity and the temporal instant cache, beside those of Debattista et al. 2009, tables 1 to 5."""

from . import animations, frames, quality, rays, scaling, still, viewport

FIGURES = {
    "first_frame": animations.first_frame,
    "animation": animations.animation,
    "whole_frame": animations.whole_frame,
    "rays": rays.measure,
    "difference": quality.difference,
    "after_edits": quality.after_edits,
    "error": quality.error,
    "viewport": viewport.measure,
    "flicker": still.measure,
    "frames": frames.measure,
    "scaling": scaling.measure,
}
