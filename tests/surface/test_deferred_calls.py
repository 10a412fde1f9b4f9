"""Linked stages are found when machine code first calls them."""

import ctypes
import subprocess
import sys
import threading

import pytest
from llvmlite import binding

from robsim.kernels.machine import machine_code
from robsim.kernels.machine.machine_code import PackageCode

SYMBOL = "robsim.tests.double_first"
STAGE = ctypes.CFUNCTYPE(None, ctypes.POINTER(ctypes.c_int64), ctypes.c_void_p, ctypes.c_int64)


class DoublingStage:
    """A stage that doubles its first whole number; each search may raise an error."""

    def __init__(self, *errors):
        self.errors, self.searches = list(errors), 0
        self.code = STAGE(self.double)

    @staticmethod
    def double(p, w, step):
        p[0] *= 2

    @property
    def address(self):
        self.searches += 1
        if self.errors:
            raise self.errors.pop(0)
        return ctypes.cast(self.code, ctypes.c_void_p).value


@pytest.fixture
def link(monkeypatch):
    """Link a stage; return the function that machine code calls."""
    codes = []

    def link(stage):
        monkeypatch.setitem(machine_code.LINKED, SYMBOL, stage)
        codes.append(PackageCode())
        codes[0].link_stage(SYMBOL)
        call = STAGE(binding.address_of_symbol(SYMBOL))

        def perform(number):
            numbers = (ctypes.c_int64 * 1)(number)
            call(numbers, None, 0)
            return numbers[0]

        return perform, codes[0]

    return link


def test_a_linked_stage_is_found_by_its_first_call(link):
    stage = DoublingStage()
    perform, _ = link(stage)
    assert stage.searches == 0
    assert [perform(3), perform(-4)] == [6, -8]
    assert stage.searches == 1


def test_a_linked_stage_is_found_in_any_thread(link):
    perform, results = link(DoublingStage())[0], []
    threads = [threading.Thread(target=lambda: results.append(perform(5))) for _ in range(4)]
    for each in threads:
        each.start()
    for each in threads:
        each.join()
    assert results == [10] * 4


def test_ctrl_c_waits_until_the_stage_has_been_performed(link):
    stage, results = DoublingStage(KeyboardInterrupt(), KeyboardInterrupt()), []
    perform, _ = link(stage)
    with pytest.raises(KeyboardInterrupt):
        results.append(perform(3))
    assert perform(7) == 14 and stage.searches == 3


def test_a_stage_without_code_fails_and_is_reported(link, capsys):
    perform, code = link(DoublingStage(OSError("no code"), OSError("no code")))
    assert perform(3) == 3 and ctypes.c_int.from_address(code.counter.value).value == 1
    assert "OSError: no code" in capsys.readouterr().err


def test_a_regular_solve_needs_no_singular_values():
    """In a process of its own: other tests use singular values."""
    code = """
import numpy as np
from robsim.kernels.linear_algebra import svd
from robsim.kernels.linear_algebra.pseudoinverse import least_squares
x, rank = np.empty((2, 1)), np.empty(1, dtype=np.int64)
for diagonal in ([1.0, 4.0], [2.0, 0.0]):
    least_squares(np.diag(diagonal)[:, :, None], np.ones((2, 1)), 0.0, 1e-9, x, rank)
    print(x[:, 0].tolist(), rank[0], bool(svd.truncate._address))
"""
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout == "[1.0, 0.25] 2 False\n[0.5, 0.0] 1 True\n"
