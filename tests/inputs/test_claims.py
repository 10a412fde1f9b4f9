"""Folders and files of results: one process at a time writes, and old files stay complete."""

import os
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

import robsim as rs
from robsim.base.folder_lock import LOCK_FILE, lock_folder
from robsim.cli.output_files import claim_results_folder

resource = pytest.importorskip("resource")  # nor are there such locks elsewhere


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def process(code, *arguments, **settings):
    command = [sys.executable, "-c", textwrap.dedent(code), *arguments]
    return subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, **settings
    )


HOLD = """
    import sys
    from pathlib import Path
    from robsim.base.folder_lock import lock_folder
    with lock_folder(Path(".")):
        print("claimed", flush=True)
        sys.stdin.readline()
"""


def test_a_folder_in_which_a_process_writes_is_not_given_to_another(here):
    other = process(HOLD)
    assert other.stdout.readline() == "claimed\n"
    with (
        pytest.raises(rs.errors.FileError, match=f"process {other.pid} is writing there"),
        lock_folder(here),
    ):
        pass
    other.communicate("\n")
    with lock_folder(here):
        assert (here / LOCK_FILE).read_text() == str(os.getpid())
    assert not list(here.iterdir())


def test_a_folder_claimed_by_a_killed_process_is_free(here):
    other = process(HOLD)
    other.stdout.readline()
    other.kill()
    other.communicate()
    assert (here / LOCK_FILE).exists()
    with lock_folder(here):
        pass
    assert not list(here.iterdir())


def test_a_claim_goes_also_after_errors(here):
    with pytest.raises(KeyboardInterrupt), lock_folder(here):
        raise KeyboardInterrupt
    assert not list(here.iterdir())


def test_each_command_makes_a_folder_of_its_own():
    with (
        claim_results_folder(None, "out", False, ()) as one,
        claim_results_folder(None, "out", False, ()) as two,
    ):
        assert (one, two) == (Path("out"), Path("out-2"))


def test_a_folder_in_which_nothing_was_written_goes_after_an_error():
    with pytest.raises(rs.errors.InputError), claim_results_folder(None, "out", False, ()):
        raise rs.errors.InputError("wrong")
    assert not Path("out").exists()


def test_only_one_of_four_commands_writes_the_same_folder(here):
    code = """
        import sys
        from pathlib import Path
        from robsim.base.atomic_files import write_whole
        from robsim.cli.output_files import claim_results_folder
        print(flush=True)
        sys.stdin.readline()
        with claim_results_folder(Path("out"), "", False, ["a"]) as folder:
            write_whole(folder / "a", "x")
            print("wrote", flush=True)
            sys.stdin.readline()
    """
    four = [process(code, stderr=subprocess.PIPE) for _ in range(4)]
    for each in four:
        each.stdout.readline()
    for each in four:
        each.stdin.write("\n")
        each.stdin.flush()
    ended = [each.communicate()[1] for each in four]
    refused = [text for text in ended if "is writing there" in text or "has a already" in text]
    assert len(refused) == 3 and ended.count("") == 1
    assert [each.name for each in (here / "out").iterdir()] == ["a"]


FULL = """
    import resource, sys, robsim as rs
    sys.dont_write_bytecode = True  # Python does not notice that a file of byte code is cut
    run = rs.load_scenario(rs.examples.path("visp_tutorial")).run(duration=0.4)
    resource.setrlimit(resource.RLIMIT_FSIZE, (2000, 2000))
    for write in (rs.save_run, lambda run, path: rs.robots.rhino_xr4().to_urdf(path),
                  lambda run, path: rs.robots.rhino_xr4().to_mjcf(path)):
        try:
            write(run, "out")
        except rs.errors.FileError as error:
            print(error)
"""


@pytest.mark.full
def test_a_full_disk_is_an_error_and_what_was_there_stays(here):
    (here / "out").write_text("mine")
    done = process(FULL)
    output = done.communicate()[0]
    assert done.returncode == 0
    assert output == "cannot write out: File too large\n" * 3
    assert [(each.name, each.read_text()) for each in here.iterdir()] == [("out", "mine")]


@pytest.mark.parametrize("suffix", ["png", "pdf", "svg"])
def test_a_figure_on_a_full_disk_leaves_the_one_that_was_there(here, called, monkeypatch, suffix):
    monkeypatch.setattr(sys, "dont_write_bytecode", True)  # a cut file would stay
    path = here / f"arm.{suffix}"
    path.write_text("mine")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (3000, before[1]))
    try:
        status, _, message = called("robots", "planar_2r", "-o", str(path), "--force")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert status == 2 and "File too large" in message and path.read_text() == "mine"
    assert called("robots", "planar_2r", "-o", str(path), "--force")[0] == 0
    assert path.stat().st_size > 3000
    assert [each.name for each in here.iterdir()] == [path.name]
