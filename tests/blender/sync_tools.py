# SPDX-License-Identifier: GPL-3.0-or-later
"""What scripts inside Blender need to test the sync by itself: the package without the native module behind it."""
import os
import sys
import types

HERE = os.path.dirname(os.path.abspath(__file__))
ADDON = os.path.join(HERE, "..", "..", "addon", "render_afterglow")


def load_sync():
    """`sync` as a package of its own: the add-on around it needs the native module, this does not."""
    if "afterglow_sync" not in sys.modules:
        package = types.ModuleType("afterglow_sync")
        package.__path__ = [os.path.join(ADDON, "sync")]
        package.__package__ = "afterglow_sync"
        sys.modules["afterglow_sync"] = package
        with open(os.path.join(ADDON, "sync", "__init__.py"), encoding="utf8") as file:
            exec(compile(file.read(), "sync/__init__.py", "exec"), package.__dict__)
    return sys.modules["afterglow_sync"]


sys.path.insert(0, HERE)
