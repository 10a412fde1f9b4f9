"""Build the site: all pages, the reference, the examples, and every shipped experiment alive.

python tools/build_site.py OUT [--experiments FOLDER]

The folder OUT/VERSION holds the site of this version; OUT/index.html opens the newest version. No
page loads anything from a server, so OUT can be opened from a folder or copied to any web site.
`--experiments` takes the pages of the experiments from a folder of an earlier build. Needs the
extra `site`. A warning of Sphinx, a broken link or a missing anchor ends the build with status 1.
"""

import shutil
import sys
import tempfile
from argparse import ArgumentParser
from pathlib import Path

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE / "site")]

from link_check import find_broken_links  # noqa: E402
from live_experiments import build_experiments, copy_experiments  # noqa: E402
from site_source import write_source  # noqa: E402
from site_versions import write_versions  # noqa: E402
from sphinx.cmd.build import build_main  # noqa: E402

import robsim as rs  # noqa: E402


def main() -> int:
    """Build the site, check its links, and return the exit status."""
    parser = ArgumentParser(description="Build the site of RobSim.")
    parser.add_argument("out", type=Path)
    parser.add_argument("--experiments", type=Path)
    options = parser.parse_args()
    site = options.out / rs.__version__
    if status := build_pages(site, options.experiments):
        return status
    write_versions(options.out)
    broken = find_broken_links(site)
    print(*broken, sep="\n", file=sys.stderr, end="\n" if broken else "")
    print(f"{len(list(site.rglob('*.html')))} pages: open {options.out / 'index.html'}")
    return int(bool(broken))


def build_pages(site: Path, experiments: Path | None) -> int:
    """Build the pages of this version, and return the exit status of Sphinx."""
    live = site / "live"
    remove_pages(site, live)
    cards = copy_experiments(experiments, live) if experiments else build_experiments(live)
    with tempfile.TemporaryDirectory() as scratch:
        source = Path(scratch) / "source"
        write_source(source, cards)
        arguments = ["-q", "-W", "--keep-going", "-j", "auto", "-c", str(HERE / "site")]
        arguments += ["-d", str(Path(scratch) / "doctrees"), str(source), str(site)]
        return int(build_main(arguments))


def remove_pages(site: Path, live: Path) -> None:
    """Remove the pages of an earlier build but the live ones."""
    for path in site.iterdir() if site.is_dir() else ():
        if path.is_dir() and path != live:
            shutil.rmtree(path)
        elif path.is_file():
            path.unlink()


if __name__ == "__main__":
    sys.exit(main())
