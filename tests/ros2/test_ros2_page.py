"""The shell lines of docs/ros2.md run as printed, from nothing to an explained bag."""

import os
import re
import subprocess
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs/ros2.md").read_text(encoding="utf-8")
LINES = re.search(r"```sh\n(.*?)```", PAGE, re.DOTALL)[1].splitlines()
INSTALL = "pip install '.[ros2]'"  # .ci/run installs it before these tests


def test_every_line_runs(ros_environment, tmp_path):
    assert len(LINES) == 10 and LINES.count(INSTALL) == 1
    assert "\ninstall_wheel ros2 " in (ROOT / ".ci/run").read_text(encoding="utf-8")
    script = "\n".join(["set -ex", *LINES]).replace(INSTALL, f"test -e {ROOT}/pyproject.toml")
    environment = {"HOME": str(tmp_path), **ros_environment}
    told = run_in_bash(script, environment)
    assert re.search(r"focal length of 'camera' is 0\.8[45]", told)


def run_in_bash(script, environment):
    """Return the output of a script; fail with it if a line fails."""
    done = subprocess.run(
        ["bash", "-c", script],
        env={**os.environ, **environment},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=200,
        check=False,
    )
    assert done.returncode == 0, done.stdout
    return done.stdout
