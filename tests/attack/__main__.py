"""Attack RobSim for some time, and print a table: `cd tests && python -m attack --minutes 60`."""

import argparse
import itertools
import os
import time
from concurrent.futures import ThreadPoolExecutor

from attack.harness import CLASSES, Tally, attacked

KINDS = ("crash", "hang", "foreign", "lost", "wrong")


def main() -> None:
    """Read the arguments, attack, and print the problems."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("classes", nargs="*", default=CLASSES, help=f"of {', '.join(CLASSES)}")
    parser.add_argument("--minutes", type=float, default=1.0, help="of wall time, for all")
    parser.add_argument("--first", type=int, default=1_000_000, help="the first seed")
    parser.add_argument("--cases", type=int, help="so many of each class instead")
    parser.add_argument("--source", help="a folder src of another RobSim")
    given = parser.parse_args()
    jobs = min(os.cpu_count() or 1, len(given.classes))
    seconds = 60 * given.minutes * jobs / len(given.classes)
    with ThreadPoolExecutor(jobs) as pool:
        tallies = pool.map(
            lambda name: attacked(name, _seeds(given, seconds), given.source), given.classes
        )
        print(f"| class | tried | taken | {' | '.join(KINDS)} |\n|{'---|' * (3 + len(KINDS))}")
        for tally in tallies:
            print(_row(tally), flush=True)
            for problem in tally.problems[:20]:
                print("  ", *problem)


def _seeds(given: argparse.Namespace, seconds: float):
    """Yield seeds from the first on, for so many seconds or so many of them."""
    end = time.monotonic() + seconds
    for seed in itertools.count(given.first):
        if seed - given.first >= given.cases if given.cases else time.monotonic() > end:
            return
        yield seed


def _row(tally: Tally) -> str:
    counts = " | ".join(str(tally.count(kind)) for kind in KINDS)
    return f"| {tally.name} | {tally.tried} | {tally.taken} | {counts} |"


if __name__ == "__main__":
    main()
