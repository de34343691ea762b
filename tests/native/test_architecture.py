# SPDX-License-Identifier: GPL-3.0-or-later
"""Includes go down the table of docs/architecture.md and never up or sideways between methods."""
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
ORDER = ["base", "scene", "rays", "materials", "lights", "transport", "methods", "display", "render", "module"]
# film stands beside the chain: it knows base alone, and methods and all above may use it.
ALLOWED = {name: set(ORDER[: i + 1]) for i, name in enumerate(ORDER)}
ALLOWED["film"] = {"base", "film"}
for name in ("methods", "display", "render", "module"):
    ALLOWED[name].add("film")


def includes(path: Path) -> list[str]:
    return re.findall(r'^#include "([^"]+)"', path.read_text(), re.M)


def test_includes_go_down() -> None:
    wrong = []
    for path in sorted((ROOT / "native").rglob("*")):
        if path.suffix not in {".h", ".cpp"}:
            continue
        folder = path.relative_to(ROOT / "native").parts[0]
        for target in includes(path):
            if "/" in target and target.split("/")[0] not in ALLOWED[folder]:
                wrong.append(f"{path.relative_to(ROOT)} includes {target}")
            method = re.match(r"methods/([^/]+)/", target)
            if folder == "methods" and method and method[1] not in path.parts and path.parent.name != "methods":
                wrong.append(f"{path.relative_to(ROOT)} includes another method: {target}")
    assert not wrong, "\n".join(wrong)


def test_every_file_names_its_licence() -> None:
    files = [p for folder in ("native", "python", "addon", "tests", "blend_files")
             for p in (ROOT / folder).rglob("*") if p.suffix in {".h", ".cpp", ".py", ".pyi"} and "__pycache__" not in p.parts]
    bare = [str(p.relative_to(ROOT)) for p in files if "SPDX-License-Identifier: GPL-3.0-or-later" not in p.read_text()[:200]]
    assert not bare, "\n".join(bare)
