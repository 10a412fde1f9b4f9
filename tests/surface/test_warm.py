"""`robsim warm`: all uses are run once, in processes, and reported."""

import sys

import pytest

import robsim as rs
from robsim import cli
from robsim.cli import warm_command, warm_workload
from robsim.declare import families
from robsim.kernels.machine import cache_files
from robsim.kernels.machine.code_archive import CodeArchive
from robsim.kernels.machine.machine_code import PACKAGE_CODE, USES_NUMBA
from robsim.kernels.machine.sources import digest_of_all


def test_the_list_has_every_example_feature_and_module():
    listed = warm_workload.list_workload()
    assert len(set(listed)) == len(listed)
    by_kind = {kind: {what for k, what in listed if k == kind} for kind, _ in listed}
    assert by_kind["example"] == set(rs.examples.names())
    assert by_kind["change"] >= {f"task.features={name}" for name in families()["feature"].kinds}
    assert by_kind["change"] >= {"task.law=camera", "task.law=joint"}
    assert by_kind["docstrings"] >= {"robsim.robot.ik.ik_result", "robsim.vision.stereo"}


def test_one_thing_is_done_as_a_user_does_it(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    done = []
    monkeypatch.setattr(rs.Experiment, "run", lambda self: done.append(self.task))
    monkeypatch.setattr(
        warm_workload.robsim, "simulate", lambda *a, **how: done.append(how["sensing"])
    )
    warm_workload.run_workload_item(("change", "sensing.noise=1"))
    warm_workload.run_workload_item(("example", "visp_tutorial"))
    task, sensing, other = done
    assert sensing.noise == 1.0 and isinstance(task, rs.IBVS)
    assert other == rs.load_scenario(rs.examples.path("visp_tutorial")).task


def test_changes_are_of_keys_that_there_are():
    changes = [what for kind, what in warm_workload.list_workload() if kind == "change"]
    assert 'sensing.effects=["outliers"]' in changes and 'actuation.effects=["lag"]' in changes
    for change in changes:
        rs.load_scenario(rs.examples.path(warm_workload.SCENARIO), [change])


def test_a_failing_use_is_reported_by_its_name():
    compiled, error = warm_command.compile_for_item(("example", "none_such"))
    assert compiled == set() and error.startswith("example none_such: InputError: no example")


@pytest.fixture
def called(monkeypatch, capsys):
    """Run `robsim warm` in this process; return its output."""

    def call():
        monkeypatch.setattr(sys, "argv", ["robsim", "warm", "-j", "1"])
        cli.main()
        return capsys.readouterr()

    return call


@pytest.fixture
def package(monkeypatch):
    """The code of the package, of which a test says what there is."""
    monkeypatch.setattr(PACKAGE_CODE, "objects", None)
    monkeypatch.setattr(PACKAGE_CODE, "bitcode", None)
    return PACKAGE_CODE


@pytest.mark.usefixtures("package")
def test_it_reports_the_compiled_kernels_their_folder_and_that_nothing_is_left(monkeypatch, called):
    monkeypatch.setattr(
        warm_command, "_run_workload", lambda jobs: ({"a", "b"}, ["example car: it broke"])
    )
    out, err = called()
    assert out.startswith("compiled 2 kernels in 0 s; stored: ") and str(cache_files.CACHE) in out
    assert err == "warning: example car: it broke\n"
    monkeypatch.setattr(warm_command, "_run_workload", lambda jobs: (set(), []))
    assert called().out.startswith("nothing to do: ")


def test_machine_code_of_the_package_leaves_nothing_to_do(monkeypatch, called, package):
    monkeypatch.setattr(warm_command, "_run_workload", lambda jobs: pytest.fail("it ran"))
    archive = CodeArchive(digest_of_all(), 15, {"robsim.a": b"BC"}, {"robsim.a": []})
    monkeypatch.setattr(package, "objects", archive)
    assert called().out.startswith(
        "nothing to do: the package has machine code for this processor; "
    )


def test_bitcode_of_the_package_is_translated_in_processes(monkeypatch, called, package):
    monkeypatch.setattr(warm_command, "_run_workload", lambda jobs: pytest.fail("it ran"))
    monkeypatch.setattr(warm_command, "_translate_bitcode", lambda jobs: {"a", "b", "c"[:jobs]})
    archive = CodeArchive(digest_of_all(), 15, {"robsim.a": b"BC"}, {"robsim.a": []})
    monkeypatch.setattr(package, "bitcode", archive)
    assert called().out.startswith("compiled 3 kernels in 0 s; stored: ")


@pytest.mark.full  # as a process of its own is started
@pytest.mark.usefixtures("package")
def test_a_process_of_its_own_does_the_work(monkeypatch, called):
    monkeypatch.setenv(USES_NUMBA, "1")
    monkeypatch.setattr(
        warm_workload, "list_workload", lambda: [("change", "sensing.noise=1"), ("example", "none")]
    )
    first, second = called(), called()
    assert first.err.count("warning: example none: InputError") == 1
    assert second.out.startswith("nothing to do: ")


def test_without_a_place_to_write_it_is_refused(monkeypatch, tmp_path, capsys):
    (tmp_path / "file").touch()
    monkeypatch.setattr(cache_files, "CACHE", tmp_path / "file" / "below")
    monkeypatch.setattr(sys, "argv", ["robsim", "warm"])
    with pytest.raises(SystemExit) as stop:
        cli.main()
    assert stop.value.code == 2
    assert (
        capsys.readouterr().err
        == f"error: cannot write {cache_files.CACHE}, the folder for kernels\n"
    )
