# SPDX-License-Identifier: GPL-3.0-or-later
"""What the panels' buttons do."""


def register() -> None:
    pass


def unregister() -> None:
    pass
