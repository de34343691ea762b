# SPDX-License-Identifier: GPL-3.0-or-later
"""Afterglow: a render engine that remembers light."""
from .records import clear_statistics, record_statistics, statistics  # noqa: F401
