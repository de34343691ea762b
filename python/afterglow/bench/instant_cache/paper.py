# SPDX-License-Identifier: GPL-3.0-or-later
"""What Debattista et al. 2009 print of whole frames and of differences, by the names of our stand-ins. Their seconds of the
diffuse part (tables 2 and 4) stand with the cases of `animations`."""

from __future__ import annotations

# Table 1: seconds of the first frame by RT (Whitted: direct and specular light alone), IGI and IC.
WHOLE_FIRST: dict[str, tuple[float, float, float]] = {
    "cornell_statue": (0.05, 0.59, 0.21), "wobbling_cylinder": (0.06, 0.62, 0.19), "desk_with_chair": (0.07, 0.76, 0.21),
    "bunnies": (0.08, 0.72, 0.33), "cornell_indirect": (0.06, 0.77, 0.24), "conference_room": (0.14, 1.58, 0.45),
    "pillared_hall": (0.19, 1.27, 0.85), "office_with_blinds": (0.09, 0.78, 0.23)}
# Table 3: frames a second by RT, IGI, IC and TIC.
WHOLE_MOVING: dict[str, tuple[float, float, float, float]] = {
    "cornell_statue": (17.07, 2.11, 6.01, 10.45), "wobbling_cylinder": (15.84, 1.63, 2.79, 8.95),
    "desk_with_chair": (12.33, 1.31, 4.92, 8.94), "bunnies_1": (13.02, 1.49, 3.42, 9.13), "bunnies_2": (12.96, 1.45, 3.55, 8.04),
    "bunnies_4": (12.81, 1.46, 3.51, 5.81), "bunnies_9": (12.69, 1.47, 3.54, 3.56), "conference_room": (6.96, 1.54, 3.37, 7.78),
    "pillared_hall": (8.23, 0.70, 1.25, 2.63)}
# Table 5: per cent of the pixels that HDR-VDP would have seen to differ from path tracing and from IGI, with a probability
# above 75 %.
DIFFERENT: dict[str, tuple[float, float]] = {
    "cornell_statue": (0.57, 0.0), "wobbling_cylinder": (0.13, 0.0), "desk_with_chair": (2.11, 0.02), "bunnies": (0.21, 0.0),
    "cornell_mirror": (0.91, 0.0), "cornell_indirect": (1.86, 0.33), "conference_room": (1.61, 0.16),
    "pillared_hall": (0.18, 0.06), "office_with_blinds": (0.45, 0.23)}
