"""Stages are called with rows by name; the program checks the shapes of the rows."""

import ast
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

import robsim as rs
from robsim.declare import families
from robsim.features.feature_rows import ObservationRows
from robsim.kernels.features.line_features import segments_stage
from robsim.kernels.features.point_features import polar_stage
from robsim.kernels.images.mark_occlusion import flag_lost_numbers
from robsim.kernels.machine.block_rows import Address, BlockRows
from robsim.kernels.machine.program import Blocks, CompiledStages, Program, evaluate_stages
from robsim.kernels.machine.signature import WrongRows
from robsim.kernels.machine.stages import CompiledStage, advance_blocks, stage

SOURCES = Path(rs.__file__).parent


@pytest.fixture
def calls(monkeypatch):
    """The arguments of each stage from here on, once for each list of shapes."""
    found, add = {}, Program.add

    def noted(program, stage, /, **rows):
        shapes = tuple((name, getattr(value, "shape", None)) for name, value in rows.items())
        found.setdefault((stage, shapes), rows)
        add(program, stage, **rows)

    monkeypatch.setattr(Program, "add", noted)
    return found


def swapped(rows):
    """All that is given, with each two rows of different shapes in each other's place."""
    named = [name for name, value in rows.items() if isinstance(value, BlockRows | Address)]
    for a, b in combinations(named, 2):
        if rows[a].shape != rows[b].shape:
            yield {**rows, a: rows[b], b: rows[a]}
    for name, value in rows.items():
        if isinstance(value, list) and value and isinstance(value[0], tuple):
            first, *rest = value
            for i, j in combinations(range(len(first)), 2):
                shapes = [getattr(first[k], "shape", None) for k in (i, j)]
                if None not in shapes and shapes[0] != shapes[1]:
                    fields = list(first)
                    fields[i], fields[j] = first[j], first[i]
                    yield {**rows, name: [tuple(fields), *rest]}


def count_refusals(calls):
    """Refuse all that is swapped; return how often that was."""
    count = 0
    for (called, _), rows in calls.items():
        assert called.signature.pack(**rows)
        for wrong in swapped(rows):
            with pytest.raises(WrongRows, match=f"^stage '{called.name}': "):
                called.signature.pack(**wrong)
            count += 1
    return count


@pytest.mark.full
def test_rows_of_another_shape_are_refused_in_every_call_of_a_shipped_program(calls):
    for name in rs.examples.names():
        scenario = rs.load_scenario(rs.examples.path(name))
        if hasattr(scenario.task, "bind"):
            assert scenario.loop().sequence.program.calls
        else:
            scenario.run(duration=2 * scenario.dt)
    assert len(calls) > 300 and count_refusals(calls) > 2500


def test_rows_of_another_shape_are_refused_in_every_feature(calls):
    seen = rs.load_scenario(rs.examples.path("eye_in_hand"))
    for name, kind in families()["feature"].kinds.items():
        given = {"radius": 0.1} if name == "sphere" else {}
        program, N = Program(), 1 if name == "sphere" else 4
        shapes = (N, 2), (N, 2), (N,), (22,), (N, 3), (3, 4)
        rows = ObservationRows(program, N, *(program.rows(*shape) for shape in shapes))
        other = ObservationRows(program, N, *(program.rows(*shape) for shape in shapes))
        rows = ObservationRows(**{**vars(rows), "other": other, "between": program.rows(3, 4)})
        if hasattr(kind, "stages"):
            kind(**given).stages(rows)
    assert seen and count_refusals(calls) > 60


def test_points_and_depths_in_each_others_place_are_named():
    program, N = Program(), 4
    points, depth = program.rows(N, 2), program.rows(N)
    s, L = program.rows(2 * N), program.rows(2 * N, 6)
    with pytest.raises(WrongRows) as error:
        program.add(polar_stage, points=depth, depth=points, goal=None, s=s, L=L)
    assert str(error.value) == (
        "stage 'polar_stage': points takes rows (N, 2), got rows 8 to 11, shape (4,)"
    )
    with pytest.raises(WrongRows) as error:
        program.add(polar_stage, points=points, depth=depth, goal=depth, s=s, L=L)
    assert str(error.value) == (
        "stage 'polar_stage': goal takes rows (2*N) where N = 4 or None, "
        "got rows 8 to 11, shape (4,)"
    )
    assert program.calls == []


@pytest.mark.parametrize("given", [3, np.int64(3), -1, (0, 1), "0", np.zeros((4, 2)), Address(3)])
def test_an_invalid_rows_is_refused(given):
    program = Program()
    rows = {"points": program.rows(4, 2), "depth": program.rows(4)}
    rows |= {"s": program.rows(8), "L": program.rows(8, 6)}
    program.add(segments_stage, **rows)
    for name in rows:
        with pytest.raises(WrongRows, match=f"stage 'segments_stage': {name} takes "):
            program.add(segments_stage, **{**rows, name: given})


def test_lists_have_their_length_and_their_entries_checked():
    program = Program()
    rows, lost = program.rows(3), program.rows(2)
    program.add(flag_lost_numbers, lost=lost, numbers=[[rows[0], rows[2]], [rows[1]]])
    ((_, numbers),) = program.calls
    assert numbers == [2, 3, 3, 2, 2, 0, 2, 1, 1]  # k, lost, start of the list, and the list
    with pytest.raises(WrongRows, match="numbers takes a list, each a list, each a row, got"):
        program.add(flag_lost_numbers, lost=lost, numbers=[[rows]])


def test_a_name_that_a_stage_does_not_have_is_refused_with_those_that_it_has():
    program = Program()
    with pytest.raises(WrongRows) as error:
        program.add(polar_stage, point=program.rows(4, 2))
    assert str(error.value) == ("stage 'polar_stage' takes points, depth, goal, s, L; got point")


def test_rows_are_cut_without_leaving_their_block():
    rows = BlockRows(7, (4, 2))
    assert [int(rows[i]) for i in (0, 1, -1)] == [7, 9, 13] and rows[1].shape == (2,)
    assert (int(rows[1, 1]), rows[1, 1].shape) == (10, ())
    assert (int(rows[1:3]), rows[1:3].shape, rows[1:3].flat.shape) == (9, (2, 2), (4,))
    assert [each.shape for each in rows] == [(2,)] * 4 and rows.size == 8
    assert rows.reshape(-1, 4).shape == (2, 4) and rows.column.shape == (8, 1)
    for wrong in (lambda: rows[4], lambda: rows[::2], lambda: rows[0, 0, 0]):
        with pytest.raises(IndexError):
            wrong()
    with pytest.raises(ValueError, match="cannot have the shape"):
        rows.reshape(3, 2)


@stage
def weighed(w, step, n="count", m="count", A="n, m", x="m", factor="whole", out="n"):
    """Compute out = factor A x, by numbers in memory."""
    for i in range(n):
        for b in range(8):
            total = 0.0
            for j in range(m):
                total += w[(A + m * i + j) * 8 + b] * w[(x + j) * 8 + b]
            w[(out + i) * 8 + b] = factor * total


def test_a_stage_of_ones_own_computes_its_formula():
    rng = np.random.default_rng(1)
    A, x = rng.normal(size=(3, 2, 5)), rng.normal(size=(2, 5))

    def add(program, A, x):
        out = program.rows(3)
        program.add(weighed, A=A, x=x, factor=2, out=out)
        return (out,)

    (found,) = evaluate_stages(add, [A, x], [(3,)])
    np.testing.assert_allclose(found, 2.0 * np.einsum("nmb,mb->nb", A, x), atol=1e-15)


@stage
def noted(w, step, log="row"):
    """Append the number of the step to the decimal digits of a row."""
    for b in range(8):
        w[log * 8 + b] = 10.0 * w[log * 8 + b] + step


@stage
def counted_down(w, step, left="row", alive="row"):
    """Reduce a row by one; a run ends at zero."""
    for b in range(8):
        w[left * 8 + b] -= 1.0
        w[alive * 8 + b] = w[left * 8 + b] > 0.0


@pytest.mark.parametrize("more", [0, 2500, 7000])  # rows: four blocks in a group, two, one
@pytest.mark.parametrize("runs", [1, 24, 85])
def test_a_block_stays_unchanged_when_its_runs_have_ended(runs, more):
    steps = np.random.default_rng(runs).integers(1, 8, runs)
    program = Program()
    log, left = program.rows(), program.each(steps[None])
    alive = program.constant(1.0)
    program.rows(more)
    program.add(noted, log=log)
    program.add(counted_down, left=left[0], alive=alive)
    compiled = CompiledStages(program.calls)
    blocks = Blocks(program, np.arange(runs))
    for start, until in ((1, 4), (4, 9)):
        parts = compiled.addresses, compiled.at, compiled.numbers
        advance_blocks(*parts, 0, blocks.flat, int(alive), start, until)
    filled = np.append(steps, np.full(-runs % 8, steps[-1]))
    last = np.repeat(filled.reshape(-1, 8).max(axis=1), 8)[:runs]  # the last run of each block
    assert [f"{digits:.0f}" for digits in blocks.get(log)] == ["12345678"[:n] for n in last]
    np.testing.assert_array_equal(blocks.get(left[0]), steps - last)


def test_stages_act_on_every_block_in_order():
    program = Program()
    log = program.rows()
    program.add(noted, log=log)
    program.add(noted, log=log)
    blocks = Blocks(program, np.arange(85))
    for step in (1, 2):
        CompiledStages(program.calls)(blocks, step)
    np.testing.assert_array_equal(blocks.get(log), 1122.0)


def adding(node):
    """Whether a call adds a stage to a program."""
    called = isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)
    if not called or node.func.attr not in {"add", "result", "computed"} or not node.args:
        return False
    return "program" in ast.unparse(node.func.value) or node.func.attr == "computed"


def by_position(node):
    """The positional arguments of a call that adds a stage, beside the stage and a shape."""
    _, *rest = node.args
    if node.func.attr == "computed":  # of so many numbers
        return rest[1:]
    return (
        rest if node.func.attr == "add" or not isinstance(rest[0], ast.Constant | ast.Name) else []
    )


@pytest.mark.full
def test_no_stage_is_given_a_number_by_its_position():
    found = unchecked = 0
    for path in SOURCES.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if adding(node):
                found += 1
                unchecked += len(by_position(node)) > 0
    assert found > 100 and unchecked == 0


def test_every_stage_but_those_called_by_symbol_declares_its_arguments():
    plain = set()
    for path in (SOURCES / "kernels").rglob("*.py"):
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            named = map(ast.unparse, getattr(node, "decorator_list", ()))
            if isinstance(node, ast.FunctionDef) and "stage" in named:
                own = node.args.args[2:]
                if len(own) != len(node.args.defaults):
                    plain.add(node.name)
    solves = {
        "by_triangle",
        "by_triangle_of_four_points",
        "rotate",
        "truncate",
        "truncate_doubtful",
    }
    assert plain == solves | {"distort_point", "undistort_points"}
    assert isinstance(weighed, CompiledStage)


def test_joined_constants_are_those_of_the_single_rows():
    program = Program()
    program.rows(2)
    first, second = program.constant([1.0, 2.0]), program.each([[3.0, 4.0]])
    program.same.append((first, np.array([5.0])))  # the last value of a row counts
    before = Blocks(program, np.arange(2)).numbers.copy()
    program.join_constants()
    assert [row for row, _ in program.same] == [0]
    after = Blocks(program, np.arange(2))
    np.testing.assert_array_equal(after.numbers, before)
    np.testing.assert_array_equal(after.get(first), [[5.0, 5.0], [2.0, 2.0]])
    np.testing.assert_array_equal(after.get(second), [[3.0, 4.0]])


def test_extended_stages_are_those_of_the_whole_program():
    program = Program()
    points, depth = program.rows(4, 2), program.rows(4)
    for _ in range(3):
        s, L = program.rows(8), program.rows(8, 6)
        program.add(polar_stage, points=points, depth=depth, goal=None, s=s, L=L)
    calls = program.stages
    whole, extended = CompiledStages(calls), CompiledStages(calls[:1]).extend(calls[1:])
    for name in ("addresses", "at", "numbers"):
        np.testing.assert_array_equal(getattr(extended, name), getattr(whole, name))
