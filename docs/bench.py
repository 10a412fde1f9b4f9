"""Write the tables of docs/bench.md: the schemes of the textbooks on every suite.

python docs/bench.py            writes them, in seconds
python docs/bench.py --check    exit status 1 if they are not up to date
"""

import sys
from pathlib import Path

import robsim as rs
from robsim.suites.suite_registry import load_quick_suites
from robsim.suites.suite_tables import SuiteTable

PAGE = Path(__file__).parent / "bench.md"


def section(name: str) -> str:
    """Return the table of a suite between its two marks."""
    found = rs.bench(name)
    (suite,) = found.suites
    head, *rows = zip(*SuiteTable(suite, found.data)._texts(), strict=True)
    rule = ["---"] * 2 + ["---:"] * (len(head) - 2)
    lines = [f"| {' | '.join(row)} |" for row in (head, rule, *rows)]
    return "\n".join([f"<!-- {name} -->", "", *lines, "", f"<!-- end of {name} -->"])


def written(text: str, name: str) -> str:
    """Return the page with the table of a suite as it is now."""
    before, rest = text.split(f"<!-- {name} -->")
    _, after = rest.split(f"<!-- end of {name} -->")
    return f"{before}{section(name)}{after}"


def main() -> int:
    """Write or check the tables."""
    text = now = PAGE.read_text(encoding="utf-8")
    for suite in load_quick_suites():
        now = written(now, suite.name)
    if "--check" in sys.argv:
        return int(now != text)
    PAGE.write_text(now, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
