"""A line on stderr where compiling takes more than a second, and nothing elsewhere."""

import io
import os
import subprocess
import sys

import numba
import pytest
from numba.core.event import Event, EventStatus

from robsim.kernels.formulas import adaptive_gain, interaction
from robsim.kernels.machine import cache_files, code_archive, stderr_messages
from robsim.kernels.machine.compiler import compile_notice

CODE = """
import numpy as np
from robsim.kernels.formulas import interaction
from robsim.kernels.machine.compiler import compile_notice
compile_notice.PATIENCE = 0.0
for _ in range(2):
    interaction.points_interaction(np.ones((1, 2, 1)), np.ones((1, 1)), np.empty((2, 6, 1)))
"""


def event(kernel, status):
    dispatcher = getattr(kernel, "dispatcher", kernel)
    return Event("numba:compile", status, {"dispatcher": dispatcher})


def start(teller, kernel):
    teller.on_start(event(kernel, EventStatus.START))


def end(teller, kernel):
    teller.on_end(event(kernel, EventStatus.END))


def wait(teller):
    """Let the clock of the outermost kernel run down."""
    teller._timer.join(10)
    assert not teller._timer.is_alive()


@pytest.fixture
def teller(monkeypatch):
    """A listener of its own, not silent in tests, with a patience of zero seconds."""
    monkeypatch.setattr(stderr_messages, "is_quiet", lambda: False)
    monkeypatch.setattr(stderr_messages, "_has_reported", False)
    monkeypatch.setattr(compile_notice, "PATIENCE", 0.0)
    return compile_notice.CompileNotice()


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_one_line_reports_the_compilation_and_its_folder(teller, capsys):
    for _ in range(2):
        start(teller, interaction.points_interaction)
        wait(teller)
        end(teller, interaction.points_interaction)
    line = f"robsim: compiling kernels, once: they are kept in {cache_files.CACHE}\n"
    assert capsys.readouterr() == ("", line)
    assert teller.compiled == ["interaction.points_interaction"] * 2


def test_before_a_second_has_passed_nothing_is_reported(teller, capsys, monkeypatch):
    monkeypatch.setattr(compile_notice, "PATIENCE", 1000.0)
    start(teller, interaction.points_interaction)
    end(teller, interaction.points_interaction)
    assert teller._timer.finished.is_set()
    assert capsys.readouterr() == ("", "")


def test_a_terminal_shows_the_present_kernel_and_keeps_the_first_line_only(teller, monkeypatch):
    screen = Terminal()
    monkeypatch.setattr(sys, "stderr", screen)
    start(teller, interaction.points_interaction)
    wait(teller)
    start(teller, adaptive_gain.compute_gains)
    first, now = screen.getvalue().split("\n")
    assert first.startswith("robsim: compiling kernels") and "0 kernels in 0 s" in now
    end(teller, adaptive_gain.compute_gains)
    end(teller, interaction.points_interaction)
    last = screen.getvalue().split("\n")[1].rsplit("\r", 2)
    assert last[1].strip() == "" and last[2] == ""


def test_code_of_the_package_that_does_not_fit_is_the_reason(teller, capsys, monkeypatch, tmp_path):
    monkeypatch.setattr(code_archive, "FOLDER", tmp_path)  # without an archive of these sources
    start(teller, interaction.points_interaction)
    wait(teller)
    end(teller, interaction.points_interaction)
    why = "the machine code of the package is damaged or of other sources"
    line = f"robsim: compiling kernels, once: they are kept in {cache_files.CACHE} ({why})\n"
    assert capsys.readouterr() == ("", line)


@pytest.mark.parametrize("variable", ["ROBSIM_QUIET", "PYTEST_CURRENT_TEST"])
def test_it_can_be_silenced_and_is_silent_in_tests(capsys, monkeypatch, variable):
    teller = compile_notice.CompileNotice()
    monkeypatch.setattr(compile_notice, "PATIENCE", 0.0)
    monkeypatch.delenv("PYTEST_CURRENT_TEST")
    monkeypatch.delenv("ROBSIM_QUIET", raising=False)
    assert not stderr_messages.is_quiet()
    monkeypatch.setenv(variable, "1")
    start(teller, interaction.points_interaction)
    wait(teller)
    end(teller, interaction.points_interaction)
    assert capsys.readouterr() == ("", "") and teller.compiled == ["interaction.points_interaction"]


def test_the_functions_of_a_user_are_not_counted(teller, capsys):
    mine = numba.njit(lambda x: x)
    start(teller, mine)
    end(teller, mine)
    assert teller.compiled == [] and capsys.readouterr() == ("", "")


def test_without_a_place_to_write_it_reports_it(teller, capsys, monkeypatch, tmp_path):
    (tmp_path / "file").touch()
    monkeypatch.setattr(cache_files, "CACHE", tmp_path / "file" / "below")
    start(teller, interaction.points_interaction)
    wait(teller)
    end(teller, interaction.points_interaction)
    assert (
        f"in each process anew: {tmp_path / 'file' / 'below'} cannot be" in capsys.readouterr().err
    )


def test_a_lost_kernel_is_reported_once_with_its_reason(teller, capsys, monkeypatch, tmp_path):
    def full(*given):
        raise OSError(28, "No space left on device")

    data = numba.njit(lambda x: x)
    data(1.0)
    (made,) = data.overloads.values()
    monkeypatch.setattr(cache_files, "CACHE", tmp_path)
    monkeypatch.setattr(cache_files, "save_code", full)
    for _ in range(2):
        interaction.points_interaction.dispatcher._cache.save_overload(made.signature.args, made)
    assert capsys.readouterr().err == (
        f"robsim: compiling kernels, in each process anew: {tmp_path} cannot be written "
        "(No space left on device)\n"
    )


@pytest.mark.full  # as processes are started
def test_a_process_reports_it_on_stderr_once_and_the_next_reports_nothing(tmp_path):
    environment = {k: v for k, v in os.environ.items() if k != "PYTEST_CURRENT_TEST"}
    environment |= {"ROBSIM_CACHE_DIR": str(tmp_path), "ROBSIM_USE_NUMBA": "1"}
    command = [sys.executable, "-c", CODE]
    first, second = (
        subprocess.run(command, capture_output=True, text=True, check=True, env=environment)
        for _ in range(2)
    )
    assert first.stdout == second.stdout == second.stderr == ""
    assert first.stderr.startswith(f"robsim: compiling kernels, once: they are kept in {tmp_path}")
    assert first.stderr.count("\n") == 1
