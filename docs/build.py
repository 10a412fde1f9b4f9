"""Write the generated pages: the reference, the commands, the kinds, lists in scenario.md, and the
table of the library in robot_library.md.

python docs/build.py            writes them
python docs/build.py --check    exit status 1 if they are not up to date
"""

import re
import sys
import tomllib
from pathlib import Path

from kinds_pages import write_kinds
from reference_pages import write_pages

import robsim as rs
from robsim.declare.kind_families import families
from robsim.robot.joint import RESISTANCES

HERE = Path(__file__).parent


def scenario() -> str:
    """Return the page on scenario files with its marked lists of kinds filled in."""

    def listed(mark: re.Match[str]) -> str:
        names = ", ".join(f'"{name}"' for name in families()[mark[1]].names)
        return f"<!-- kinds: {mark[1]} -->{names}<!-- -->"

    return re.sub(r"<!-- kinds: (.*?) -->.*?<!-- -->", listed, _read(HERE / "scenario.md"))


def robots() -> str:
    """Return the page on robots with its marked table of the library filled in."""
    rows = ["| robot | mass | largest effort | drives | source of the masses |", "| --- " * 5 + "|"]
    for name in rs.robots.names():
        file = tomllib.loads(rs.robots.file(name).read_text(encoding="utf-8"))
        found = [text for text in file["sources"] if text.startswith(("Inertias: ", "Weight: "))]
        source = found[0].partition(": ")[2].replace("|", "\\|")
        rows.append(f"| `{name}` | {' | '.join(_list_weights(rs.robots.load(name)))} | {source} |")
    table = "\n".join(["<!-- robots -->", "", *rows, "", "<!-- /robots -->"])
    pattern = "<!-- robots -->.*?<!-- /robots -->"
    return re.sub(pattern, lambda _: table, _read(HERE / "robot_library.md"), flags=re.DOTALL)


def _list_weights(robot: rs.Robot) -> tuple[str, str, str]:
    """Return the mass, the largest effort, and the known numbers of the drives of a robot."""
    total = sum(link.inertial.mass for link in robot.links if link.inertial)
    joints = [link.joint for link in robot.links]
    units = {"rad": "N m", "m": "N"}
    efforts = [(j.effort, units[j.model.units[0]]) for j in joints if j.effort is not None]
    known = [part for part in RESISTANCES if any(getattr(joint, part) for joint in joints)]
    mass = f"{total:.4g} kg" if total else ""
    return mass, "{:g} {}".format(*max(efforts)) if efforts else "", ", ".join(known)


def main() -> int:
    """Write or check the pages."""
    pages = {name: write() for name, write in write_pages().items()}
    pages |= {**write_kinds(), "scenario.md": scenario(), "robot_library.md": robots()}
    stale = [name for name, text in pages.items() if _read(HERE / name) != text]
    if "--check" in sys.argv:
        print(*[f"docs/{name} is not up to date: python docs/build.py" for name in stale], sep="\n")
        return int(bool(stale))
    for name in stale:
        (HERE / name).parent.mkdir(exist_ok=True)
        (HERE / name).write_text(pages[name], encoding="utf-8")
    return 0


def _read(path: Path) -> str:
    return path.read_text(encoding="utf-8") if path.exists() else ""


if __name__ == "__main__":
    sys.exit(main())
