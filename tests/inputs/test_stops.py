"""Ctrl-C and its like: nothing is lost, however often and in whatever order they come."""

import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest
from numba import njit, types
from numba.extending import overload

import robsim as rs
from robsim.base import interrupt
from robsim.engine.loop import BURST, Loop
from robsim.files import examples
from robsim.kernels.machine.compiler import dispatchers  # noqa: F401  it listens to Numba
from robsim.kernels.machine.machine_code import PackageCode

SIGNALS = list(interrupt.SIGNALS)
LONG = rs.load_scenario(examples.path("visp_tutorial")).with_(
    sensing=rs.Sensing(noise=0.5), duration=400_000.0, record=100
)


@pytest.fixture(autouse=True)
def _as_in_a_fresh_process():
    """Python's own handlers, even if the shell that started us had one ignored."""
    for number in SIGNALS:
        own = signal.default_int_handler if number == signal.SIGINT else signal.SIG_DFL
        signal.signal(number, own)


def handlers():
    return [signal.getsignal(number) for number in SIGNALS]


@pytest.mark.parametrize("first", SIGNALS)
def test_all_stops_are_one_thing_and_any_number_of_them_keeps_what_was_simulated(first, capfd):
    def stop(share):
        if share > 0:
            for number in (first, *SIGNALS):
                signal.raise_signal(number)

    before = handlers()
    with pytest.raises(rs.errors.Interrupted) as error:
        LONG.run(stop)
    run = error.value.run
    assert handlers() == before and run.outcome == rs.Outcome.RUNNING and run.sizes["time"] > 1
    assert np.isfinite(run.q).all()
    output = capfd.readouterr().err.splitlines()
    assert set(output) == {"robsim: saving what was simulated so far"}
    assert len(output) >= len(SIGNALS)


@pytest.mark.parametrize("number", SIGNALS[1:])
def test_an_ignored_or_foreign_handler_stays_so(number):
    came = []

    def send(share):
        signal.raise_signal(number)

    short = LONG.with_(duration=4.0)
    whole = short.run()
    for handler in (signal.SIG_IGN, lambda *given: came.append(given)):
        signal.signal(number, handler)
        assert short.run(send).identical(whole)
        assert signal.getsignal(number) is handler
    assert came


def test_a_stop_before_anything_was_simulated_is_keyboard_interrupt(monkeypatch):
    def stop(self):
        signal.raise_signal(signal.SIGINT)
        raise AssertionError("not stopped")

    monkeypatch.setattr(rs.Experiment, "loop", stop)
    with pytest.raises(KeyboardInterrupt):
        LONG.run()
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_a_comparison_that_is_stopped_while_it_measures_has_the_simulated_part(monkeypatch):
    from robsim.analysis import compared_scheme

    def stop(*given):
        signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGINT)
        return measured(*given)

    measured = compared_scheme.measure_run
    short = LONG.with_(duration=4.0, record="all")
    pair = {"a": short, "b": short.at("task.gain", 1.0)}
    whole = rs.compare(pair)
    for record in ("all", "summary"):
        alike = {name: each.with_(record=record) for name, each in pair.items()}
        with monkeypatch.context() as patched, pytest.raises(rs.errors.Interrupted) as error:
            patched.setattr(compared_scheme, "measure_run", stop)
            rs.compare(alike)
        found = error.value.run
        assert found.names == ("a",)
        assert found.data.rotation.values == whole.data.rotation.values[0]


def test_a_summary_that_is_stopped_between_its_parts_has_those_that_were_done(monkeypatch):
    from robsim.analysis import compared_scheme

    def stop(*given):
        signal.raise_signal(signal.SIGINT)
        return measured(*given)

    measured = compared_scheme.measure_run
    monkeypatch.setattr("robsim.analysis.run_arrays.BLOCK", 250)  # of 101 moments: two runs
    starts = np.repeat(LONG.start[None], 5, axis=0)
    case = LONG.with_(duration=4.0, record="summary", start=starts)
    monkeypatch.setattr(compared_scheme, "measure_run", stop)
    with pytest.raises(rs.errors.Interrupted) as error:
        rs.compare({"a": case})
    outcome = error.value.run.data.outcome.values[0]
    assert (outcome[:2] != rs.Outcome.RUNNING).all() and (outcome[2:] == rs.Outcome.RUNNING).all()


class Clock:
    """A clock that advances with each step."""

    def __init__(self, seconds):
        self.now, self.seconds = 0.0, seconds

    def perf_counter(self):
        return self.now


@pytest.mark.parametrize(("seconds", "burst"), [(1e-6, BURST), (0.005, 10), (0.2, 1)])
def test_stops_are_looked_for_about_every_twentieth_of_a_second(monkeypatch, seconds, burst):
    clock, taken, take = Clock(seconds), [], Loop._take

    def noted(self, going, steps):
        taken.append(steps)
        clock.now += steps * clock.seconds
        return take(self, going, steps)

    monkeypatch.setattr("robsim.engine.loop.time", clock)
    monkeypatch.setattr(Loop, "_take", noted)
    whole = LONG.with_(duration=20.0).run()
    monkeypatch.undo()
    assert taken[-2] == burst and max(taken[4:]) <= burst
    assert whole.identical(LONG.with_(duration=20.0).run())


# ---- the compiler, and imports ----


def interrupting():
    """A function that is interrupted while it is compiled, the first time."""

    def asked():
        raise NotImplementedError

    @overload(asked)
    def _compiled():
        if not came:
            came.append(1)
            signal.raise_signal(signal.SIGINT)
        return lambda: 3

    came = []
    return njit(lambda: asked() + 1), came


def test_ctrl_c_waits_for_the_compiler_which_then_works_on():
    function, came = interrupting()
    with pytest.raises(KeyboardInterrupt):
        function()
    assert came and function.signatures == [()] and function() == 4
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_ctrl_c_of_somebody_else_does_not_wait_for_the_compiler():
    heard, (function, came) = [], interrupting()
    signal.signal(signal.SIGINT, lambda *given: heard.append(list(came)))
    assert function() == 4 and heard == [[1]]


def test_a_kernel_that_another_thread_compiles_leaves_the_handlers_alone():
    function = njit(lambda x: x + 1)
    thread = threading.Thread(target=function, args=(1,))
    thread.start()
    thread.join()
    assert function.signatures == [(types.int64,)]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_ctrl_c_waits_until_the_code_of_the_package_is_loaded():
    class Archive:
        @property
        def parts(self):
            signal.raise_signal(signal.SIGINT)
            came.append(1)
            return {}

    came, code = [], PackageCode()
    code.objects = code.bitcode = Archive()
    with pytest.raises(KeyboardInterrupt):
        code.find("robsim.a")
    assert came == [1, 1]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


# ---- the command line ----

TOLD = """
import sys
from robsim.engine import loop
advance, sent = loop.Loop.advance, []
def told(self, going, done):
    def tell(share):
        done(share)
        if not sent:
            sent.append(print("begun", flush=True))
    advance(self, going, tell)
loop.Loop.advance = told
from robsim.cli import main
main()
"""


def started(folder, *arguments, code=TOLD):
    Path(folder, "long.toml").write_text(LONG.with_(duration=40_000.0).to_toml(), encoding="utf-8")
    return subprocess.Popen(
        [sys.executable, "-c", code, *arguments],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "ROBSIM_QUIET": "1"},
    )


@pytest.mark.full
@pytest.mark.parametrize("number", SIGNALS)
def test_a_command_that_is_stopped_saves_and_reports_the_file_and_the_signal(tmp_path, number):
    child = started(tmp_path, "run", "long.toml", "-o", "out")
    while child.stdout.readline() != "begun\n":
        assert child.poll() is None
    child.send_signal(number)
    while "stopping" not in child.stderr.readline():
        assert child.poll() is None
    for each in SIGNALS:
        child.send_signal(each)
    _, err = child.communicate(timeout=100)
    assert child.returncode == 128 + number and "Traceback" not in err
    assert err.endswith("stopped; what was simulated so far is in out\n")
    names = sorted(path.name for path in (tmp_path / "out").iterdir())
    assert names == ["checkpoint", "run.nc", "scenario.toml"]
    run = rs.open_run(tmp_path / "out" / "run.nc")
    assert run.outcome == rs.Outcome.RUNNING and np.isfinite(run.q).all()


def test_a_command_that_is_stopped_while_it_imports_prints_a_word(tmp_path):
    code = """
import importlib, os, signal, sys
class Finder:
    def find_spec(self, name, path, target=None):
        if name == "robsim.cli.compare_command":
            os.kill(os.getpid(), signal.SIGTERM)
sys.meta_path.insert(0, Finder())
from robsim.cli import main
main()
"""
    child = started(tmp_path, "run", "long.toml", "-o", "out", code=code)
    out, err = child.communicate(timeout=100)
    assert (child.returncode, out) == (143, "") and err.strip() == "stopped"
    assert not (tmp_path / "out").exists()


def test_a_run_is_taken_up_by_the_same_command(tmp_path, called, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("short.toml").write_text(LONG.with_(duration=40.0).to_toml(), encoding="utf-8")
    take = Loop._take

    def stop(self, going, burst):
        signal.raise_signal(signal.SIGTERM)
        return take(self, going, burst)

    with monkeypatch.context() as patched:
        patched.setattr(Loop, "_take", stop)
        status, out, err = called("run", "short.toml", "-o", "out", "--no-figures")
    assert status == 143 and "outcome" not in out
    assert err.startswith("stopping: saving what was simulated so far\n")
    status, _, err = called("run", "short.toml", "-o", "out", "--no-figures")
    assert status == 2 and "run.nc, scenario.toml, checkpoint already" in err
    status, out, err = called("run", "short.toml", "-o", "out", "--no-figures", "--resume")
    assert (status, err) == (0, "") and "outcome" in out
    assert rs.open_run("out/run.nc").identical(rs.load_scenario("short.toml").run())
    assert sorted(os.listdir("out")) == ["run.nc", "scenario.toml"]
    status, _, err = called("run", "short.toml", "-o", "out", "--no-figures", "--resume")
    assert (status, err) == (2, "error: nothing to resume: out has no checkpoint\n")
    status, _, err = called("run", "short.toml", "--resume")
    assert status == 2 and "name the folder of the run with -o" in err
