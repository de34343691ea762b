# SPDX-License-Identifier: GPL-3.0-or-later
"""How the zips for official Blender and for Debian's are made; tools/package.py is the entry."""
