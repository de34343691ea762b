# SPDX-License-Identifier: GPL-3.0-or-later
"""How far an image is from the truth: relMSE in three ways, MS-SSIM, FLIP, and the flicker of a sequence.

Images are (height, width, ≥ 3) scene-linear; further channels (alpha) are ignored. MS-SSIM and FLIP look at the image as
it is displayed: exposed like relMSE unless told otherwise, sRGB-encoded, cut to [0, 1].
"""

from .error import Estimate, exposure, halves_relmse, luminance, mean_ratio, relmse, trimmed_relmse
from .flicker import moving_flicker, still_flicker
from .flip import flip, flip_map
from .ssim import ms_ssim

__all__ = [
    "Estimate", "exposure", "flip", "flip_map", "halves_relmse", "luminance", "mean_ratio", "moving_flicker", "ms_ssim",
    "relmse", "still_flicker", "trimmed_relmse",
]
