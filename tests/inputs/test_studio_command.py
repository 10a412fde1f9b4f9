"""The command that serves a studio: its output, the visitors it admits, and how it ends."""

from __future__ import annotations

import re
import signal
import subprocess
import sys
import urllib.error
import urllib.request

import pytest

from robsim import examples, load_scenario, save_run
from robsim.cli.studio_command import _load_shown

COMMAND = [sys.executable, "-m", "robsim", "studio"]


@pytest.fixture
def served():
    """A studio in a process of its own, which ends in any case."""
    how = {"stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL, "text": True}
    with subprocess.Popen([*COMMAND, "--no-open"], **how) as process:
        try:
            yield process
        finally:
            process.kill()


@pytest.mark.full
def test_it_serves_those_who_have_the_address_and_ends_with_ctrl_c(served):
    output = served.stdout.readline()
    address = re.search(r"http://127\.0\.0\.1:\d+/\?token=\S+", output)[0]
    assert output.strip() == f"open {address} in a browser; Ctrl-C ends it"
    opener = urllib.request.build_opener(urllib.request.HTTPCookieProcessor())
    page = opener.open(address, timeout=20).read().decode()
    assert page.startswith("<!doctype html>") and "connect-src 'self'" in page
    text = opener.open(f"{address.partition('?')[0]}download/experiment.toml").read()
    assert text.decode() == load_scenario(examples.path("eye_in_hand")).text
    with pytest.raises(urllib.error.HTTPError, match="403") as refused:
        urllib.request.urlopen(address.partition("?")[0], timeout=20)
    refused.value.close()
    served.send_signal(signal.SIGINT)
    assert served.wait(20) == 0 and served.stdout.read() == ""


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["nothing.toml"], "nothing.toml: no such file"),
        (["nothing.nc"], "nothing.nc: no such file"),
        (["."], "no scenario file (*.toml)"),
        (["--host", "0.0.0.0"], "--allow-remote"),
        (["--port", "99999"], "99999 is not in the range"),
        (["--speed"], "No such option"),
    ],
)
def test_each_fault_is_reported_before_anything_is_served(
    arguments, reason, tmp_path, monkeypatch, called
):
    monkeypatch.chdir(tmp_path)
    status, out, err = called("studio", *arguments)
    assert status == 2 and reason in err and not out


def test_a_file_a_run_and_a_folder_are_found(tmp_path):
    experiment = load_scenario(examples.path("visp_tutorial"))
    (tmp_path / "a.toml").write_text(experiment.text)
    (tmp_path / "results").mkdir()
    save_run(experiment.run(duration=0.4), tmp_path / "results" / "run.nc")
    assert _load_shown(tmp_path / "a.toml")[0] == experiment
    for path in (tmp_path / "results", tmp_path / "results" / "run.nc"):
        assert _load_shown(path)[0] == experiment.with_(duration=0.4)
    chosen, shelf = _load_shown(tmp_path)
    assert chosen == experiment and [each["name"] for each in shelf.entries] == ["a"]
