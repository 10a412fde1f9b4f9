"""Time from opening a page of the built site in a folder to its first paint, in Chromium.

python benchmarks/first_paint.py OUT       OUT is the folder of tools/build_site.py

Each page is opened five times in a new tab; the table has the median and the largest time. A bare
page, which has a heading alone, shows the share of the browser.
"""

import shutil
import statistics
import sys
import tempfile
from pathlib import Path

from playwright.sync_api import Browser, sync_playwright

import robsim as rs

PAGES = (
    *("index", "begin/install", "howto/errors", "explanation/interaction_matrices"),
    *("gallery/large_rolls", "experiments/index", "examples/index", "scenario"),
    *("reference/index", "reference/robsim/IBVS", "bench/calibration", "CHANGELOG"),
)
REPEATS = 5
PAINT = "performance.getEntriesByName('first-contentful-paint')[0]?.startTime"
BARE = "<!doctype html><title>bare</title><h1>bare</h1>"


def main() -> None:
    """Print the times of the pages."""
    site = Path(sys.argv[1]) / rs.__version__
    with sync_playwright() as driver, tempfile.TemporaryDirectory() as scratch:
        bare = Path(scratch) / "bare.html"
        bare.write_text(BARE, encoding="utf-8")
        path = shutil.which("chromium")
        browser = driver.chromium.launch(executable_path=path, args=["--no-sandbox"])
        print(f"{'page':36} {'median':>8} {'largest':>8}  ms")
        for page in [bare, *(site / f"{name}.html" for name in PAGES)]:
            times = [measure_paint(browser, page) for _ in range(REPEATS)]
            name = page.relative_to(site) if page != bare else "bare page"
            print(f"{name!s:36} {statistics.median(times):8.0f} {max(times):8.0f}")


def measure_paint(browser: Browser, page: Path) -> float:
    """Return the milliseconds from the navigation to the first paint."""
    tab = browser.new_page(offline=True)
    tab.goto(page.as_uri())
    tab.wait_for_function(PAINT)
    time = float(tab.evaluate(PAINT))
    tab.close()
    return time


if __name__ == "__main__":
    main()
