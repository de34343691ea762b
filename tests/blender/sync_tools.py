# SPDX-License-Identifier: GPL-3.0-or-later
"""What scripts inside Blender need to test the sync by itself: the package without the native module behind it."""
import json
import os
import sys
import traceback
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


def finish(work):
    """Runs work() and prints what it returns. Leaves at once: Blender as a module may hang on its way out."""
    try:
        print("RESULT " + json.dumps(work()), flush=True)
    except BaseException:
        traceback.print_exc()
        sys.stdout.flush()
        os._exit(1)
    os._exit(0)


sys.path.insert(0, HERE)
