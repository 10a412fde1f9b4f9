"""Lanes: each of eight runs is rounded as a number alone is."""

import numpy as np
import pytest
from numba import njit

from robsim.kernels.formulas.lane_math import arc_tangent, cos_sin, log_of_fraction
from robsim.kernels.machine.block_io import gather_rows, scatter_rows
from robsim.kernels.machine.compiler import dispatchers  # noqa: F401  Numba learns of lanes
from robsim.kernels.machine.lanes import (
    WIDTH,
    absolute,
    any_lane,
    fill_lanes,
    get,
    get_lane,
    put,
    replace_lane,
    sqrt,
    where,
)

ODD = np.array([0.0, -0.0, 1.0, -2.5, np.inf, -np.inf, np.nan, 1e-310])


@njit
def computed(block):
    """Every operation on rows 0 and 1, from row 2 on."""
    a, b = get(block, 0), get(block, 1)
    put(block, 2, a + b)
    put(block, 3, a - b)
    put(block, 4, a * b)
    put(block, 5, a / b)
    put(block, 6, -a)
    put(block, 7, sqrt(absolute(a)))
    put(block, 8, where(a < b, a, b))
    put(block, 9, where(a >= 1.0, 2 * a, 0.5))
    put(block, 10, 1.0 - a * 3 / b)
    put(block, 11, 7)
    c = a
    c += b
    c *= a
    c -= 1.0
    c /= b
    put(block, 12, c)
    put(block, 13, where(a == b, 1.0, where(a > b, 2.0, where(a <= b, 3.0, 4.0))))
    return any_lane(a > b), any_lane(a > 1e300)


def expected(a, b):
    with np.errstate(all="ignore"):
        compared = np.select([a == b, a > b, a <= b], [1.0, 2.0, 3.0], 4.0)
        return np.array(
            [
                *(a + b, a - b, a * b, a / b, -a, np.sqrt(np.abs(a)), np.where(a < b, a, b)),
                *(np.where(a >= 1.0, 2 * a, 0.5), 1.0 - a * 3 / b, np.full(WIDTH, 7.0)),
                *(((a + b) * a - 1.0) / b, compared),
            ]
        )


@njit
def turned(block):
    """Cosine and sine of row 0, in rows 1 and 2."""
    c, s = cos_sin(get(block, 0))
    put(block, 1, c)
    put(block, 2, s)


@njit
def filled(block, x, i, y):
    """Lanes that hold x, with y in lane i; return the numbers in the lanes i and i + 1."""
    lanes = replace_lane(fill_lanes(x), i, y)
    put(block, 0, lanes)
    return get_lane(lanes, i), get_lane(lanes, i + 1)


def test_a_number_fills_all_lanes_and_another_replaces_it_in_one():
    block = np.zeros(WIDTH)
    assert filled(block, 2.5, 3, -1.0) == (-1.0, 2.5)
    np.testing.assert_array_equal(block, [2.5, 2.5, 2.5, -1.0, 2.5, 2.5, 2.5, 2.5])


@njit
def taken(block):
    """The logarithm of row 0, in row 1."""
    put(block, 1, log_of_fraction(get(block, 0)))


def test_logarithms_of_fractions_are_correct_to_one_unit_in_the_last_place():
    rng = np.random.default_rng(1)
    near_one, near_root = 1.0 - 2.0 ** -rng.uniform(1, 53, 800), rng.uniform(-1e-9, 1e-9, 800)
    special = np.append(2.0 ** -np.arange(64.0), [1.0 - 2.0**-53, 0.75, *[0.5] * 6])
    small, roots = 2.0 ** -rng.uniform(0, 63, 800), np.sqrt(0.5) * (1.0 + near_root)
    x = np.concatenate([rng.random(800), near_one, roots, small, special]).reshape(-1, WIDTH)
    for each in x:
        block = np.concatenate([each, np.empty(WIDTH)])
        taken(block)
        exact = np.log(each.astype(np.longdouble))
        assert (np.abs(block[WIDTH:] - exact) <= np.spacing(np.abs(exact.astype(float)))).all()


@njit
def angled(block):
    """The angle of (row 1, row 0) in row 2, and of single numbers in row 3."""
    put(block, 2, arc_tangent(get(block, 0), get(block, 1)))
    for i in range(WIDTH):
        block[3 * WIDTH + i] = arc_tangent(block[i], block[WIDTH + i])


def angles_of(y, x):
    """Angles of many points, each computed on lanes and alone."""
    found = []
    for each in np.stack([y, x]).reshape(2, -1, WIDTH).transpose(1, 0, 2):
        block = np.concatenate([each.ravel(), np.full(2 * WIDTH, np.nan)])
        angled(block)
        found.append(block.reshape(4, WIDTH)[2:])
    return np.concatenate(found, axis=1)


def test_arc_tangents_are_correct_to_two_units_in_the_last_place():
    """Against long doubles; near the ends of the parts into which the ratio is divided, too."""
    rng = np.random.default_rng(3)
    borders = np.array([0.0, 0.4375, 0.6875, 1.0, 1 / 0.6875, 1 / 0.4375])
    ratio = np.concatenate([rng.uniform(0, 1, 4000), 10 ** rng.uniform(-300, 300, 4000)])
    near = (borders[:, None] * (1.0 + rng.uniform(-1e-15, 1e-15, (6, 200)))).ravel()
    ratio = np.concatenate([ratio, near])
    x = rng.choice([-1.0, 1.0], ratio.size) * 10 ** rng.uniform(-3, 3, ratio.size)
    y = rng.choice([-1.0, 1.0], ratio.size) * np.abs(x) * ratio
    exact = np.arctan2(y.astype(np.longdouble), x.astype(np.longdouble))
    lanes, alone = angles_of(y, x)
    assert lanes.tobytes() == alone.tobytes()
    assert (np.abs(lanes - exact) <= 2 * np.spacing(np.abs(exact.astype(float)))).all()


def test_arc_tangents_of_zero_and_of_infinite_numbers():
    y = np.array([0.0, -0.0, 0.0, 1.0, -1.0, np.inf, -np.inf, 1.0])
    x = np.array([0.0, 0.0, 2.0, 0.0, 0.0, 1.0, 1.0, np.inf])
    lanes, alone = angles_of(y, x)
    np.testing.assert_array_equal(lanes, np.arctan2(y, x))
    np.testing.assert_array_equal(np.signbit(lanes), np.signbit(y))
    assert lanes.tobytes() == alone.tobytes()
    assert np.isnan(angles_of(np.full(8, np.inf), np.full(8, np.inf))).all()
    assert np.isnan(angles_of(np.full(8, np.nan), np.ones(8))).all()
    np.testing.assert_array_equal(angles_of(np.zeros(8), -np.ones(8)), np.full((2, 8), np.pi))


@pytest.mark.parametrize("far", [2e5, -1e300, np.inf, np.nan])
def test_the_angle_of_a_run_far_away_changes_no_bit_of_its_neighbours(far):
    x = np.random.default_rng(0).uniform(-9, 9, WIDTH)
    alone, beside = (np.concatenate([x, np.zeros(2 * WIDTH)]) for _ in range(2))
    beside[3] = far
    turned(alone)
    turned(beside)
    others = np.arange(WIDTH) != 3
    alone, beside = (block.reshape(3, WIDTH)[1:] for block in (alone, beside))
    np.testing.assert_array_equal(beside[:, others], alone[:, others])
    with np.errstate(invalid="ignore"):
        np.testing.assert_array_equal(beside[:, 3], [np.cos(far), np.sin(far)])


@pytest.mark.parametrize("shift", range(WIDTH))
def test_every_operation_agrees_with_numpy_to_the_bit(shift):
    rng = np.random.default_rng(shift)
    pairs = [rng.normal(size=(2, WIDTH)) * 10.0 ** rng.integers(-9, 9, (2, WIDTH))]
    pairs += [np.stack([ODD, np.roll(ODD, shift)])]
    for a, b in pairs:
        block = np.concatenate([a, b, np.full(12 * WIDTH, np.nan)])
        found = computed(block)
        np.testing.assert_array_equal(block[2 * WIDTH :].reshape(12, WIDTH), expected(a, b))
        assert found == ((a > b).any(), (a > 1e300).any())


@pytest.mark.parametrize("runs", [1, 7, 8, 9, 20])
def test_rows_come_back_from_blocks_and_the_last_run_fills_the_rest(runs):
    x, again = np.random.default_rng(0).normal(size=(3, runs)), np.full((3, runs), np.nan)
    for b in range(0, runs, WIDTH):
        block = np.zeros(5 * WIDTH)
        gather_rows(x, b, 2, block)
        rows = block.reshape(5, WIDTH)
        assert not rows[:2].any()
        left = min(WIDTH, runs - b)
        np.testing.assert_array_equal(rows[2:, left:], x[:, -1:].repeat(WIDTH - left, axis=1))
        scatter_rows(block, 2, b, again)
    np.testing.assert_array_equal(again, x)


def test_a_product_that_is_added_is_rounded_twice():
    """No fused multiply-add, which some machines have and others lack."""

    @njit
    def fused(block):
        put(block, 3, get(block, 0) * get(block, 1) + get(block, 2))

    block = np.zeros(4 * WIDTH)
    block[:WIDTH], block[WIDTH : 2 * WIDTH] = 1.0 + 2.0**-30, 1.0 - 2.0**-30
    block[2 * WIDTH : 3 * WIDTH] = -1.0
    fused(block)
    assert (block[3 * WIDTH :] == 0.0).all()  # fused it were -2**-60
