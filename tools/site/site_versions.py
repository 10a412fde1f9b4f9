"""The list of the versions beside their folders, and the page that opens the newest."""

import json
from pathlib import Path

OPEN = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>RobSim</title>
<meta http-equiv="refresh" content="0; url={newest}/index.html"></head>
<body><p><a href="{newest}/index.html">RobSim {newest}</a></p></body></html>
"""


def write_versions(out: Path) -> None:
    """Write versions.js and index.html for the versions that a folder holds."""
    versions = list_versions(out)
    text = f"window.ROBSIM_VERSIONS = {json.dumps(versions)};\n"
    (out / "versions.js").write_text(text, encoding="utf-8")
    (out / "index.html").write_text(OPEN.format(newest=versions[0]), encoding="utf-8")


def list_versions(out: Path) -> list[str]:
    """Return the versions in a folder, the newest first."""
    found = [page.parent.name for page in out.glob("*.*.*/index.html")]
    return sorted(found, key=lambda name: [int(n) for n in name.split(".")], reverse=True)
