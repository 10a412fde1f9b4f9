"""Write the tables of docs/bench/: the schemes of the textbooks on every suite, and a summary.

python docs/bench.py            writes them, in seconds
python docs/bench.py --check    exit status 1 if they are not up to date
"""

import re
import sys
from pathlib import Path

import robsim as rs
from robsim.suites.suite_registry import load_quick_suites
from robsim.suites.suite_tables import SuiteTable

FOLDER = Path(__file__).parent / "bench"
SCHEMES = {
    "IBVS, L current": "L current",
    "IBVS, L desired": "L desired",
    "IBVS, L mean": "L mean",
    "PBVS, goal form": "PBVS, goal",
    "PBVS, camera form": "PBVS, camera",
    "2 1/2 D": "2 1/2 D",
    "partitioned": "partitioned",
}


def section(name: str) -> str:
    """Return the table of a suite between its two marks."""
    found = rs.bench(name)
    (suite,) = found.suites
    head, *rows = zip(*SuiteTable(suite, found.data)._texts(), strict=True)
    rule = ["---"] * 2 + ["---:"] * (len(head) - 2)
    lines = [f"| {' | '.join(row)} |" for row in (head, rule, *rows)]
    return mark(name, lines)


def mark(name: str, lines: list[str]) -> str:
    """Return lines between the two marks of a name."""
    return "\n".join([f"<!-- {name} -->", "", *lines, "", f"<!-- end of {name} -->"])


def written(text: str, name: str, table: str = "") -> str:
    """Return a page with a table as it is now: by default, the table of a suite."""
    before, rest = text.split(f"<!-- {name} -->")
    _, after = rest.split(f"<!-- end of {name} -->")
    return f"{before}{table or section(name)}{after}"


def summary(pages: dict[str, str]) -> str:
    """Return the table of all suites: the successes of each scheme over all of its runs."""
    lines = [f"| suite | {' | '.join(SCHEMES.values())} |", "| --- |" + " ---: |" * len(SCHEMES)]
    for name, text in pages.items():
        title, shares = text.partition("\n")[0].removeprefix("# "), read_shares(text)
        if shares:
            cells = " | ".join(shares.get(scheme, "") for scheme in SCHEMES)
            lines.append(f"| [{title}]({name}.md) | {cells} |")
    return mark("summary", lines)


def read_shares(page: str) -> dict[str, str]:
    """Return the percentage of successes of each scheme, from the rows of all groups together."""
    rows = re.search(r"^\| all \|.*\n(?:\|  \|.*\n)*", page, re.M)
    found = re.findall(r"^\| (?:all)? ?\| (.+?) \| ([\d.]+) %", rows[0] if rows else "", re.M)
    return dict(found)


def main() -> int:
    """Write or check the tables."""
    names = [suite.name for suite in load_quick_suites()]
    old = {name: (FOLDER / f"{name}.md").read_text(encoding="utf-8") for name in ["index", *names]}
    new = {name: written(old[name], name) for name in names}
    new["index"] = written(old["index"], "summary", summary(new))
    if "--check" in sys.argv:
        return int(new != old)
    for name, text in new.items():
        (FOLDER / f"{name}.md").write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
