"""A run that was stopped and taken up again has the bits of one that was not."""

import signal
import subprocess
import sys
import warnings
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import robsim as rs
from robsim.container import pack_container, unpack_container
from robsim.declare import register
from robsim.files import examples
from robsim.run import checkpoint

VISP = rs.load_scenario(examples.path("visp_tutorial"))
NOISY = VISP.with_(sensing=rs.Sensing(noise=0.5, latency=0.1), duration=80.0)
STARTS = VISP.start + np.outer(np.linspace(-0.02, 0.05, 13), np.eye(1, 7))
MISSION = """
schema = 1
robots = [{ model = "planar_2r" }]
run = { dt = "1 ms", duration = "2 s" }
[task]
kind = "mission"
phases = [
    { name = "there", task = { kind = "follow_joints", to = ["30 deg", "0.5 rad"], duration = "2 s" } },
    { name = "back", task = { kind = "follow_joints", by = ["-0.5 rad", "-0.5 rad"], duration = "2 s" } },
    { name = "on", task = { kind = "follow_joints", by = ["1 rad", "0.1 rad"], duration = "2 s" } },
]
"""  # noqa: E501


@dataclass(frozen=True)
class Remembering:
    """A law that keeps the sum of all errors of each run, and uses it."""

    def command(self, state):
        total = state.memory.get("sum", np.zeros(state.error.shape)) + state.error
        state.memory["sum"] = total
        return -0.4 * state.error[:, :6] - 1e-4 * total[:, :6]


def watch_dots():
    """An experiment that finds its marks in late pictures with noise and a rolling shutter."""
    target, eye = VISP.scene.objects[0], VISP.scene.camera()
    dots = rs.Object(
        target.name,
        dots=rs.vision.DotPattern(0.6 * np.asarray(target.marks)[:, :2], radius=0.02),
        pose=target.pose,
        on=target.on,
    )
    optics = rs.vision.Optics(read_noise=1.0, full_well=9000, readout=0.01)
    small = replace(eye, camera=eye.camera.resized(120, 90), optics=optics)
    task = rs.IBVS(VISP.task.goal, detector="dots")
    return NOISY.with_(scene=rs.Scene(VISP.scene.robots, dots, small), task=task, duration=8.0)


def cases():
    """Experiments by name."""
    register("law", "remembering")(Remembering)
    batch = NOISY.with_(start=STARTS)
    return {
        "single": NOISY,
        "batch": batch,
        "every fifth": batch.with_(record=5),
        "summary": batch.with_(record="summary"),
        "varied": NOISY.vary({"task.gain": np.linspace(0.3, 0.7, 9)}),
        "a law in Python": batch.with_(task=rs.IBVS(VISP.task.goal, law=Remembering())),
        "a law that looks ahead": batch.with_(
            task=rs.IBVS(VISP.task.goal, law=rs.laws.RolloutLaw(schemes=[rs.PBVS()])), duration=16.0
        ),
        "pictures": watch_dots().with_(start=STARTS[:5]),
        "mission": rs.Experiment.from_text(MISSION),
    }


@cache
def simulate_whole(name):
    run = cases()[name].run()
    return run if name != "mission" else run.run


@pytest.fixture(autouse=True)
def _often(monkeypatch, tmp_path):
    """Checkpoints at every look of a tenth of a second, and Ctrl-C as Python has it."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(checkpoint, "INTERVAL", 0.0)
    monkeypatch.setattr(checkpoint, "SHARE", np.inf)
    signal.signal(signal.SIGINT, signal.default_int_handler)


def stop_after(experiment, at, monkeypatch, **how):
    """Stop an experiment after a number of bursts; return the run so far."""
    from robsim.engine.loop import Loop

    taken, take = [], Loop._take

    def counted(self, going, burst):
        taken.append(going)
        if len(taken) == at:
            self.stopped = True
        return take(self, going, burst)

    with monkeypatch.context() as patched:
        patched.setattr(Loop, "_take", counted)
        with pytest.raises(rs.errors.Interrupted) as stop:
            experiment.run(checkpoint="point", **how)
    return stop.value.run


@pytest.mark.covering(2)
@pytest.mark.parametrize("name", list(cases()))
@pytest.mark.parametrize("at", [1, 4, 9])
@pytest.mark.parametrize("chunk", [3, 256])
@pytest.mark.few(4)
def test_a_resumed_run_has_the_same_bits(name, at, chunk, monkeypatch):
    experiment = cases()[name]
    part = stop_after(experiment, at, monkeypatch, chunk=chunk, threads=1)
    if name != "mission":
        assert (part.outcome == rs.Outcome.RUNNING).any()
    run = experiment.run(checkpoint="point", resume=True, threads=2)
    assert (run.run if name == "mission" else run).identical(simulate_whole(name))


def test_a_mission_that_was_stopped_has_the_part_of_its_phase(monkeypatch):
    run = stop_after(cases()["mission"], 40, monkeypatch)
    assert [leg.outcome.name for leg in run.legs] == ["CONVERGED", "RUNNING"]
    done = run.run
    np.testing.assert_array_equal(done.q, simulate_whole("mission").q[: done.sizes["time"]])


def test_a_mission_that_is_stopped_when_a_phase_has_ended_is_taken_up(monkeypatch):
    dataset = rs.Experiment.dataset

    def stopped_meanwhile(self, loop):
        signal.raise_signal(signal.SIGINT)
        return dataset(self, loop)

    with monkeypatch.context() as patched:
        patched.setattr(rs.Experiment, "dataset", stopped_meanwhile)
        with pytest.raises(rs.errors.Interrupted) as stop:
            cases()["mission"].run(checkpoint="point")
    assert [leg.outcome.name for leg in stop.value.run.legs] == ["CONVERGED"]
    run = cases()["mission"].run(checkpoint="point", resume=True)
    assert run.run.identical(simulate_whole("mission"))


def test_a_run_can_be_stopped_and_taken_up_again_and_again(monkeypatch):
    batch = cases()["batch"]
    stop_after(batch, 2, monkeypatch, chunk=5)
    for at in (3, 5):
        stop_after(batch, at, monkeypatch, resume=True)
    assert batch.run(checkpoint="point", resume=True).identical(simulate_whole("batch"))


KILLED = """
import os, signal, sys
import robsim as rs
from robsim.run import checkpoint
checkpoint.INTERVAL, checkpoint.SHARE = 0.0, 1.0
save = checkpoint.CheckpointFile.save
def killed(self):
    save(self)
    os.kill(os.getpid(), signal.SIGKILL)
checkpoint.CheckpointFile.save = killed
rs.load_scenario("long.toml").run(checkpoint="point")
"""


@pytest.mark.full  # as a process of its own is started
@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="there is no such signal here")
def test_a_run_that_was_killed_goes_on_from_its_last_checkpoint():
    long = NOISY.with_(duration=20_000.0, record=1000)
    Path("long.toml").write_text(long.to_toml(), encoding="utf-8")
    done = subprocess.run([sys.executable, "-c", KILLED], check=False)
    assert done.returncode == -signal.SIGKILL
    long = rs.load_scenario("long.toml")
    assert long.run(checkpoint="point", resume=True).identical(long.run())


def get_refusal(experiment=NOISY, path="point"):
    with pytest.raises(rs.errors.FileError) as error:
        experiment.run(checkpoint=path, resume=True)
    return str(error.value)


def test_a_checkpoint_that_does_not_serve_is_refused_by_its_reason(monkeypatch):
    stop_after(NOISY, 3, monkeypatch)
    content = Path("point").read_bytes()
    assert (
        get_refusal(NOISY.with_(seed=1)) == "point is of another experiment, or of other settings"
    )
    assert get_refusal(cases()["batch"]) == "point is of another experiment, or of other settings"
    assert get_refusal(path="none") == "no checkpoint none: run without resume"
    for at in (0, 9, len(content) // 2, len(content) - 60):
        Path("wrong").write_bytes(content[:at] + bytes([content[at] ^ 1]) + content[at + 1 :])
        assert get_refusal(path="wrong").startswith("wrong is damaged: it was changed")
    Path("wrong").write_bytes(content[1:])
    assert get_refusal(path="wrong").startswith("wrong is damaged: it was changed")
    rs.save_run(NOISY.run(duration=0.4), "run.nc")
    for wrong in (b"", b"mine", content[:-1], content[:60], content + b"x"):
        Path("wrong").write_bytes(wrong)
        assert get_refusal(path="wrong").startswith(
            "wrong is not a checkpoint of this version of RobSim"
        )
    assert get_refusal(path="run.nc").startswith("run.nc is not a checkpoint")
    monkeypatch.setattr(checkpoint, "KERNEL_HASH", "0" * 16)
    assert "cannot be resumed: RobSim was" in get_refusal()


def test_a_checkpoint_is_taken_up_on_another_machine_which_is_told(monkeypatch):
    """The processor is another; here the bits are the same, as the machine code is."""
    stop_after(NOISY, 3, monkeypatch)
    monkeypatch.setattr(checkpoint, "find_processor_name", lambda: "x86 abacus")
    with pytest.warns(
        rs.errors.FileWarning, match=r"point: the processor was .*, and here is .* abacus"
    ):
        run = NOISY.run(checkpoint="point", resume=True)
    assert run.identical(simulate_whole("single"))


def forged(change):
    """Write a checkpoint with a right checksum, changed by `change(chunk, arrays)`."""
    with open("point", "rb") as file:
        header, arrays = unpack_container(file)
    change(header["loops"][0]["chunks"][0], arrays)
    Path("forged").write_bytes(pack_container(header, arrays).getbuffer())


def put(chunk, **values):
    chunk.update(values)


@pytest.mark.parametrize(
    "change",
    [
        lambda chunk, arrays: put(chunk, step=10**9),
        lambda chunk, arrays: put(chunk, step=-1),
        lambda chunk, arrays: put(chunk, step=1.5),
        lambda chunk, arrays: put(chunk, runs=4),
        lambda chunk, arrays: put(chunk, runs=10**12),
        lambda chunk, arrays: put(chunk, done="no"),
        lambda chunk, arrays: put(chunk, memory=[["a"]]),
        lambda chunk, arrays: put(chunk, memory=[[]]),
        lambda chunk, arrays: chunk.clear(),
        lambda chunk, arrays: arrays.pop(),
        lambda chunk, arrays: arrays.__setitem__(0, arrays[0][:, :, :-1]),
        lambda chunk, arrays: arrays.__setitem__(1, arrays[1][:, :-1]),
        lambda chunk, arrays: arrays.__setitem__(2, ~arrays[2]),
        lambda chunk, arrays: arrays.__setitem__(2, np.arange(13)),
        lambda chunk, arrays: arrays.__setitem__(3, arrays[3][:, :-1]),
        lambda chunk, arrays: arrays.__setitem__(3, arrays[3].view(np.int64)),
    ],
)
def test_a_forged_checkpoint_is_refused_whatever_its_checksum(monkeypatch, change):
    stop_after(cases()["batch"], 3, monkeypatch)
    forged(change)
    assert "forged does not fit its experiment: " in get_refusal(cases()["batch"], "forged")


def test_numbers_of_a_forged_checkpoint_reach_no_memory_of_others(monkeypatch):
    """All numbers of the runs are odd; the rows of their storage stay their own."""
    batch = cases()["batch"]
    stop_after(batch, 3, monkeypatch)
    for odd in (-1e18, 1e18, np.nan, 7.0, 5e-324):
        forged(lambda chunk, arrays, odd=odd: arrays[3].fill(odd))
        run = batch.run(checkpoint="forged", resume=True)
        assert run.sizes == simulate_whole("batch").sizes


def test_resume_needs_a_file():
    with pytest.raises(rs.errors.InputError, match="resume: from which file"):
        NOISY.run(resume=True)


def test_an_experiment_without_a_text_has_no_checkpoint_and_is_refused_at_once():
    class Mine:
        def command(self, state):
            raise AssertionError("nothing runs")

    with pytest.raises(rs.errors.InputError):
        NOISY.with_(task=rs.IBVS(VISP.task.goal, law=Mine())).run(checkpoint="point")


def test_where_no_checkpoint_can_be_written_that_is_reported_once_and_the_run_goes_on(monkeypatch):
    Path("file").touch()
    long = NOISY.with_(duration=4_000.0, record="summary")
    with warnings.catch_warnings(record=True) as record:
        warnings.simplefilter("always")
        run = long.run(lambda share: None, checkpoint="file/point")
    assert [each.category for each in record] == [rs.errors.FileWarning]
    assert str(record[0].message).startswith("no checkpoint: cannot write file/point")
    assert run.identical(long.run())
