"""Entries: Python calls machine code with arguments of declared types, and nothing else."""

import os
import pickle
import re
import signal
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

import numpy as np
import pytest

import robsim as rs
from robsim.kernels.formulas import se3
from robsim.kernels.formulas.image_moments import moment_powers
from robsim.kernels.formulas.random import fill_normal_pairs
from robsim.kernels.image_features.picture_sums import reduce_pictures
from robsim.kernels.machine.argument_types import DTYPES, NUMBERS, ArgumentTypes
from robsim.kernels.machine.entry import entry
from robsim.kernels.machine.kernel import kernel
from robsim.kernels.raster.picture import draw_pictures
from robsim.rendering import renderer
from robsim.shapes import Block


@entry("int64, float64[::1], out float64[:, ::1]")
def add_rows(count, x, total):
    """Add count x to each row."""
    for i in range(total.shape[0]):
        for j in range(x.size):
            total[i, j] += count * x[j]


@entry("float64, int64, uint64, bool -> float64, int64, int64, bool")
def pass_numbers(code, out, numbers, status):
    """Return the arguments; their names occur in code that calls machine code."""
    return code, out, numbers, status


@entry("float64[::1], float64 -> bool")
def is_any_above(x, least):
    """Return whether a number exceeds another one."""
    found = False
    for i in range(x.size):
        found = found or x[i] > least
    return found


@entry("float64[::1] -> float64")
def add_all(x):
    """Return the sum."""
    total = 0.0
    for i in range(x.size):
        total += x[i]
    return total


@entry("int64 -> float64")
def allocate_numbers(count):
    """Return the last of so many numbers."""
    numbers = np.empty(count)
    numbers[count - 1] = 1.0
    return numbers[count - 1]


@entry("int64, Pair(float64[::1], out float64[::1])")
def copy_numbers(count, pair):
    """Copy the first numbers of a pair to the other one."""
    for i in range(count):
        pair.factors[i] = pair.x[i]


PLAIN = "Pair(float64[::1], None), int64"
WEIGHED = "Pair(float64[::1], float64[::1]), int64"


class Pair(NamedTuple):
    """Numbers, and perhaps factors."""

    x: Any
    factors: Any = None


@kernel
def find_factor(factors, i):
    """Return a factor; 1 without factors."""
    return 1.0 if factors is None else factors[i]


@entry(f"{PLAIN} -> float64", f"{WEIGHED} -> float64")
def weigh(pair, i):
    """Return a number of a pair times its factor."""
    return pair.x[i] * find_factor(pair.factors, i)


def build_arguments():
    return 2, np.array([1.0, 10.0]), np.arange(6.0).reshape(3, 2)


EXPECTED = np.arange(6.0).reshape(3, 2) + np.array([2.0, 20.0])


@pytest.mark.parametrize(
    "arrange",
    [
        np.asfortranarray,
        lambda total: total.T.copy().T,
        lambda total: np.repeat(total, 2, axis=0)[::2],
        lambda total: np.repeat(total, 2, axis=1)[:, ::2],
        lambda total: total[::-1].copy()[::-1],
        lambda total: total.view(np.recarray),
    ],
    ids=["Fortran", "transposed", "rows", "columns", "reversed", "subclass"],
)
def test_an_array_in_another_order_is_copied_and_copied_back(arrange):
    count, x, total = build_arguments()
    given = arrange(total)
    add_rows(count, x, given)
    np.testing.assert_array_equal(given, EXPECTED)


def test_numbers_that_are_not_aligned_are_copied_and_copied_back():
    count, x, total = build_arguments()
    given = np.zeros(49, np.uint8)[1:].view(np.float64).reshape(3, 2)
    given[...] = total
    assert not given.flags.aligned
    add_rows(count, x, given)
    np.testing.assert_array_equal(given, EXPECTED)


def test_numbers_between_those_of_a_view_stay():
    whole = np.full((3, 4), 7.0)
    whole[:, ::2] = build_arguments()[2]
    add_rows(2, np.array([1.0, 10.0]), whole[:, ::2])
    np.testing.assert_array_equal(whole[:, ::2], EXPECTED)
    np.testing.assert_array_equal(whole[:, 1::2], 7.0)


def test_inputs_may_be_read_only_in_any_order():
    for x in (np.array([1.0, 10.0]), np.array([1.0, 5.0, 10.0])[::2]):
        count, _, total = build_arguments()
        x.flags.writeable = False
        add_rows(count, x, total)
        np.testing.assert_array_equal(total, EXPECTED)
        np.testing.assert_array_equal(x, [1.0, 10.0])


@pytest.mark.parametrize("arrange", [np.copy, np.asfortranarray, lambda total: total[::-1]])
def test_a_read_only_output_is_an_error_before_anything_is_written(arrange):
    count, x, total = build_arguments()
    given = arrange(total)
    given.flags.writeable = False
    with pytest.raises(
        ValueError, match=r"^kernel 'add_rows' writes to total, but it is read-only"
    ):
        add_rows(count, x, given)
    np.testing.assert_array_equal(given, arrange(build_arguments()[2]))


def test_a_read_only_output_in_a_tuple_is_an_error():
    x, y = np.ones(3), np.zeros(6)
    copy_numbers(2, Pair(x, y[::2]))
    np.testing.assert_array_equal(y, [1, 0, 1, 0, 0, 0])
    x.flags.writeable = y.flags.writeable = False
    with pytest.raises(ValueError, match=r"writes to pair\[1\], but it is read-only$"):
        copy_numbers(3, Pair(x, y))
    np.testing.assert_array_equal(y, [1, 0, 1, 0, 0, 0])


def test_memory_mapped_files_are_outputs_if_they_are_writable(tmp_path):
    count, x, total = build_arguments()
    np.save(tmp_path / "total.npy", total)
    with pytest.raises(ValueError, match="read-only"):
        add_rows(count, x, np.load(tmp_path / "total.npy", mmap_mode="r"))
    add_rows(count, x, np.load(tmp_path / "total.npy", mmap_mode="r+"))
    np.testing.assert_array_equal(np.load(tmp_path / "total.npy"), EXPECTED)


def test_an_input_that_was_copied_is_not_copied_back():
    total = build_arguments()[2]
    x = total.reshape(-1)[::3]  # changes with the output
    add_rows(1, x, total)
    np.testing.assert_array_equal(total, build_arguments()[2] + np.array([0.0, 3.0]))


def unpickle(array):
    return pickle.loads(pickle.dumps(array))


def mark_unit(array):
    return array.astype(np.dtype(array.dtype, metadata={"unit": "m"}))


@pytest.mark.parametrize("copy", [unpickle, mark_unit])
def test_an_array_with_its_own_object_for_the_element_type_is_accepted(copy):
    """Pickle makes such objects: a scene that comes from another process has them."""
    count, x, total = build_arguments()
    given = copy(total)
    assert given.dtype is not total.dtype and given.dtype == total.dtype
    add_rows(count, copy(x), given)
    np.testing.assert_array_equal(given, EXPECTED)


def test_a_pickled_experiment_runs_with_the_same_bits():
    experiment = rs.load_scenario(rs.examples.path("visp_tutorial")).with_(duration=0.1)
    again = pickle.loads(pickle.dumps(experiment))
    assert again.run().identical(experiment.run())
    robot = rs.robots.load("puma560")
    q = pickle.loads(pickle.dumps(robot.home))
    np.testing.assert_array_equal(robot.fk(q), robot.fk(robot.home))


def test_whole_numbers_of_another_name_and_the_same_size_are_accepted():
    runs, out = np.arange(3, dtype=np.ulonglong), [np.empty((2, 2, 3)) for _ in range(2)]
    fill_normal_pairs(3, runs, 1, 2, out[0])
    fill_normal_pairs(np.uint64(3), runs.astype(np.uint64), np.int32(1), np.int8(2), out[1])
    np.testing.assert_array_equal(*out)


WRONG = {
    "element type": (1, np.zeros(2, np.float32), "float32[:]"),
    "whole numbers": (1, np.zeros(2, np.int64), "int64[:]"),
    "byte order": (1, np.zeros(2, ">f8"), ">f8[:]"),
    "objects": (1, np.zeros(2, object), "object[:]"),
    "records": (1, np.zeros(2, [("a", "f8")]), "[('a', '<f8')][:]"),
    "more axes": (1, np.zeros((1, 2)), "float64[:, :]"),
    "fewer axes": (2, np.zeros(2), "float64[:]"),
    "no axes": (1, np.array(1.0), "float64[]"),
    "list": (1, [1.0, 10.0], "list"),
    "None": (2, None, "NoneType"),
    "number": (2, 3.0, "float"),
    "text": (1, "text", "str"),
    "class": (1, np.ndarray, "type"),
    "element": (1, np.float64(1.0), "float64"),
    "tuple": (1, (1.0, 2.0), "(float, float)"),
    "array for a number": (0, np.zeros(2), "float64[:]"),
    "fraction": (0, 1.5, "float"),
    "fraction of NumPy": (0, np.float64(1.0), "float64"),
    "no number": (0, None, "NoneType"),
}


@pytest.mark.parametrize("case", WRONG)
def test_another_type_is_an_error_that_names_the_kernel_and_both_types(case):
    place, value, name = WRONG[case]
    arguments, names = list(build_arguments()), ["int", "float64[:]", "float64[:, :]"]
    arguments[place], names[place] = value, name
    with pytest.raises(TypeError) as error:
        add_rows(*arguments)
    assert str(error.value) == (
        "kernel 'add_rows' takes int64, float64[::1], out float64[:, ::1]; got " + ", ".join(names)
    )
    untouched = build_arguments()[2]
    if place != 2:
        np.testing.assert_array_equal(arguments[2], untouched)


@pytest.mark.parametrize("arguments", [(), (1,), (1, 2, 3, 4)])
def test_another_number_of_arguments_is_an_error_that_names_the_kernel(arguments):
    with pytest.raises(TypeError, match=r"^add_rows\(count, x, total\) got \d arguments$"):
        add_rows(*arguments)


@pytest.mark.parametrize("kind", [int, np.int8, np.int32, np.int64, np.uint16, np.array, np.bool_])
def test_whole_numbers_of_any_kind_are_accepted(kind):
    _, x, total = build_arguments()
    add_rows(kind(1), x, total)
    np.testing.assert_array_equal(total, build_arguments()[2] + x)


@pytest.mark.parametrize("number", [1 << 63, -(1 << 63) - 1, 1 << 64, 10**30])
def test_a_whole_number_of_more_than_64_bits_is_an_error(number):
    _, x, total = build_arguments()
    with pytest.raises(TypeError, match=r"^kernel 'add_rows' takes .*; got int, float64\[:\]"):
        add_rows(number, x, total)


def test_the_largest_whole_numbers_are_passed_exactly():
    assert pass_numbers(0.0, 2**63 - 1, 1, False)[1] == 2**63 - 1
    assert pass_numbers(0.0, -(2**63), 1, False)[1] == -(2**63)
    out = [np.empty((2, 2, 3)) for _ in range(2)]
    for seed, each in zip((2**64 - 1, np.uint64(2**64 - 1)), out, strict=True):
        fill_normal_pairs(seed, np.arange(3, dtype=np.uint64), 1, 2, each)
    np.testing.assert_array_equal(*out)
    with pytest.raises(TypeError, match="got int, uint64"):
        fill_normal_pairs(-1, np.arange(3, dtype=np.uint64), 1, 2, out[0])


@pytest.mark.parametrize("error", [OSError, KeyboardInterrupt])
def test_an_error_of_a_conversion_does_not_stay_behind(error):
    class Broken:
        def __index__(self):
            raise error

    _, x, total = build_arguments()
    with pytest.raises(TypeError, match="got Broken, float64"):
        add_rows(Broken(), x, total)
    np.testing.assert_array_equal(total, build_arguments()[2])


@pytest.mark.parametrize("kind", [float, int, np.float32, np.float64, np.int64, np.array])
def test_real_numbers_of_any_kind_are_accepted(kind):
    assert se3.log_coefficient(kind(2)) == se3.log_coefficient(2.0)
    assert se3.log_coefficient(kind(0)) == 1 / 12


def test_results_are_numbers_of_python():
    assert moment_powers(4) == (1, 1) and {type(each) for each in moment_powers(4)} == {int}
    found = pass_numbers(0.1, -3, 5, True)
    assert found == (0.1, -3, 5, True) and list(map(type, found)) == [float, int, int, bool]
    assert pass_numbers(-np.inf, np.int32(-1), np.uint64(2), np.False_) == (-np.inf, -1, 2, False)
    x = np.array([1.0, 3.0, 2.0])
    assert is_any_above(x, 2.5) is True and is_any_above(x, 3) is False
    assert is_any_above(x[::2], 2.5) is False
    assert add_all(x) == 6.0 and type(add_all(x)) is float and add_all(x[:0]) == 0.0
    assert add_rows(*build_arguments()) is None


def test_a_named_tuple_with_none_has_code_of_its_own():
    x, factors = np.array([1.0, 2.0]), np.array([5.0, 7.0])
    assert weigh(Pair(x), 1) == 2.0 and weigh(Pair(x, factors), 1) == 14.0
    assert weigh(Pair(x), np.int64(0)) == 1.0
    assert weigh(Pair(x[::-1], factors[::-1]), 1) == 5.0
    with pytest.raises(TypeError) as error:
        weigh(Pair(x, 3), 1)
    got = "(float64[:], int), int"
    assert str(error.value) == f"kernel 'weigh' takes {PLAIN} or {WEIGHED}; got {got}"


def test_variants_with_the_same_c_types_have_different_code():
    pictures, found = np.arange(48.0).reshape(1, 6, 8), []
    for dtype in (np.uint8, np.float32, np.uint8):
        found.append(np.empty((1, 3, 4), np.float32))
        reduce_pictures(pictures.astype(dtype), 2, found[-1])
    expected = pictures.reshape(1, 3, 2, 4, 2).mean(axis=(2, 4))
    np.testing.assert_array_equal(found, [expected] * 3)


def test_a_picture_is_drawn_by_the_variant_for_its_lens_and_its_prints(monkeypatch):
    used = []

    def noted(*arguments):
        used.append(
            [i for i, each in enumerate(draw_pictures.variants) if each.may_take(arguments)]
        )
        draw_pictures(*arguments)

    monkeypatch.setattr(renderer, "draw_pictures", noted)
    K = np.array([[84.0, 0.0, 46.9], [0.0, 90.0, 36.7], [0.0, 0.0, 1.0]])
    blocks = Block(0.3, 0.3, 0.1), Block(0.3, 0.3, 0.1, picture=np.eye(4, dtype=np.uint8) * 200)
    lenses = {}, {"distortion": (-1e-9, 0.0, 0.0, 0.0)}
    eyes = [rs.MountedCamera("eye", rs.Camera(K, (96, 72), **lens)) for lens in lenses]
    for block in blocks:
        thing = rs.Object("block", block, pose=rs.Pose.at(0, 0, 1.6))
        one, other = (rs.Scene(objects=thing, cameras=eye).picture() for eye in eyes)
        assert one.std() > 1.0
        np.testing.assert_allclose(one.astype(float), other, rtol=0, atol=1.0)
    assert used == [[0], [2], [1], [3]] and len(draw_pictures.variants) == 4


def test_a_variant_that_does_not_fit_is_not_compiled():
    @entry("int64[::1], None -> int64", "int64[::1], int64[::1] -> int64")
    def count(first, second):
        return first.size if second is None else first.size + second.size

    numbers = np.arange(3)
    assert count(numbers, numbers) == 6
    assert "call" not in vars(count.variants[0])
    assert count(numbers, None) == 3 and count(numbers, numbers) == 6


@pytest.mark.parametrize("declared", ["complex128", "float16[::1]", "int32", "(int64, object)"])
def test_an_unknown_type_is_refused_where_it_is_declared(declared):
    with pytest.raises(TypeError, match=r"^unknown argument type "):
        entry(f"int64, {declared}")(lambda first, second: None)


@pytest.mark.parametrize("declared", ["int64", "int64, int64, int64", "(int64, int64)"])
def test_another_number_of_types_is_refused_where_they_are_declared(declared):
    with pytest.raises(TypeError, match=r"^2 arguments, but types "):
        entry(declared)(lambda first, second: None)


@pytest.mark.parametrize(
    ("declared", "message"),
    [
        ("int64, out int64", "a kernel cannot write to a number, out int64"),
        ("int64, out (int64, float64[::1])", "a kernel cannot write to a number, out int64"),
        ("int64, int64 -> int32", "unknown result type int32"),
        ("int64, int64 -> int64, float64[::1]", "unknown result type float64[::1]"),
        (f"int64, ({'int64, ' * 128})", "129 arguments, but only 128"),
    ],
)
def test_a_declaration_that_cannot_be_is_refused(declared, message):
    with pytest.raises(TypeError, match=f"^{re.escape(message)}$"):
        entry(declared)(lambda first, second: None)


def test_outputs_are_named_by_their_place():
    declared = "out float64[::1], Pair(int64[::1], out int64[::1]), out (int64[::1], (int64[::1],))"
    types = ArgumentTypes(["a", "b", "c"], declared)
    written = [leaf.path for leaf in types.leaves if leaf.is_output]
    assert written == ["a", "b[1]", "c[0]", "c[1][0]"]


def test_a_declaration_gives_the_arguments_of_the_c_function():
    declared = "int64, (uint16[:, :, ::1], (bool, uint64)), Pair(float64[::1], None)"
    types = ArgumentTypes(["a", "b", "c"], declared)
    assert [leaf.name for leaf in types.leaves] == ["a0", "a1", "a2", "a3", "a4"]
    assert [leaf.path for leaf in types.leaves] == ["a", "b[0]", "b[1][0]", "b[1][1]", "c[0]"]
    assert [leaf.axes for leaf in types.leaves] == [0, 3, 0, 0, 1]
    assert [leaf.kind for leaf in types.leaves] == ["int64", "array", "bool", "uint64", "array"]
    assert types.absent == ["c[1]"] and len(types.values) == 3
    assert types.values[2].startswith("Pair(") and types.values[2].endswith("None, )")
    for dtype in DTYPES:
        assert len(ArgumentTypes(["x"], f"{dtype}[:, ::1]").leaves) == 1
    for number in NUMBERS:
        assert ArgumentTypes(["x"], number).leaves[0].axes == 0


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # Numba reports it
def test_too_little_memory_is_an_error_that_names_the_kernel():
    assert allocate_numbers(3) == 1.0
    with pytest.raises(MemoryError, match=r"^kernel 'allocate_numbers' failed: too little memory"):
        allocate_numbers(1 << 58)
    assert allocate_numbers(3) == 1.0


def test_a_call_refers_to_no_object_afterwards():
    arguments = (2, *build_arguments()[1:])
    objects = [*arguments[1:], None]
    add_rows(*arguments), add_all(arguments[1]), moment_powers(4)
    before = list(map(sys.getrefcount, objects))
    for _ in range(1000):
        add_rows(*arguments), add_all(arguments[1]), moment_powers(4)
        add_rows(*arguments[:2], np.asfortranarray(arguments[2]))
    after = list(map(sys.getrefcount, objects))
    assert max(abs(a - b) for a, b in zip(after, before, strict=True)) < 100


def test_entries_run_in_threads_without_the_lock():
    """Each thread writes to its own array; a call of another thread goes on meanwhile."""

    def work(number):
        total = np.zeros((3, 2))
        for _ in range(2000):
            add_rows(number, np.array([1.0, 10.0]), total)
            assert pass_numbers(0.5, number, 1, True) == (0.5, number, 1, True)
        return total[0, 0]

    with ThreadPoolExecutor(8) as pool:
        assert list(pool.map(work, range(8))) == [2000.0 * number for number in range(8)]


def test_the_first_calls_may_come_from_several_threads():
    @entry("float64 -> float64")
    def double(x):
        return 2.0 * x

    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(double, range(16))) == [2.0 * x for x in range(16)]


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
def test_a_forked_process_calls_what_its_parent_has_called():
    code = """
import os, warnings
import numpy as np
import robsim as rs
robot = rs.robots.load("puma560")
expected = robot.fk(robot.home)
warnings.simplefilter("ignore")
if child := os.fork():
    _, status = os.waitpid(child, 0)
    assert os.waitstatus_to_exitcode(status) == 7
    np.testing.assert_array_equal(robot.fk(robot.home), expected)
else:
    same = (robot.fk(robot.home) == expected).all()
    first = np.isfinite(robot.jacobian(robot.home)).all()
    os._exit(7 if same and first else 1)
"""
    subprocess.run([sys.executable, "-c", code], check=True, timeout=100)


@pytest.mark.skipif(not hasattr(signal, "SIGALRM"), reason="needs SIGALRM")
def test_an_interrupt_during_many_calls_is_raised_between_them():
    total, x = np.zeros((3, 2)), np.array([1.0, 10.0])
    add_rows(1, x, total)
    before = signal.signal(signal.SIGALRM, signal.default_int_handler)
    signal.setitimer(signal.ITIMER_REAL, 0.05)
    try:
        with pytest.raises(KeyboardInterrupt):
            while True:
                add_rows(1, x, total)
    finally:
        signal.signal(signal.SIGALRM, before)
    np.testing.assert_array_equal(total, total[:1].repeat(3, axis=0))
    add_rows(1, x, total)
