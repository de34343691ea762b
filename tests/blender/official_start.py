# SPDX-License-Identifier: GPL-3.0-or-later
"""Starts a test script in an official Blender (the module bpy) with the packaged extension installed and enabled.

Arguments: the zip, then the script, then a .blend file or "-". The installation lives in BLENDER_USER_RESOURCES and is made
once. Blender 4.2 as a module crashes at its end whenever an add-on registered a panel, so the process ends itself.
"""

import os
import sys
import traceback
from pathlib import Path

import bpy

archive, script, file = sys.argv[1:4]
name = "bl_ext.user_default.afterglow"
installed = Path(os.environ["BLENDER_USER_RESOURCES"]) / "extensions" / "user_default" / "afterglow"
code = 0
try:
    import addon_utils

    if not installed.is_dir():
        bpy.ops.extensions.package_install_files(filepath=archive, repo="user_default", enable_on_install=True)
    addon_utils.enable(name, default_set=True, persistent=True)
    if file != "-":
        bpy.ops.wm.open_mainfile(filepath=file)
    with open(script) as text:
        exec(compile(text.read(), script, "exec"), {"__name__": "__main__"})
except BaseException:
    traceback.print_exc()
    code = 1
sys.stdout.flush()
sys.stderr.flush()
os._exit(code)
