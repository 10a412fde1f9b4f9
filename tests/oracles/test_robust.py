"""Robust weights and their scale against statsmodels and 40 digits (generate_robust.py)."""

import json
from pathlib import Path

import numpy as np
import pytest

from robsim.kernels.estimation import m_estimator
from robsim.kernels.machine.lanes import WIDTH

STORED = json.loads((Path(__file__).parent / "robust_statsmodels.json").read_text())
KINDS = {"huber": m_estimator.HUBER, "tukey": m_estimator.TUKEY, "cauchy": m_estimator.CAUCHY}


def weights(distances, kind, least):
    """Weights (N, B) of distances (N, B) by the kernel, for as many runs as there are lanes."""
    N, rows = len(distances), np.full((2 * len(distances) + 1, WIDTH), float(least))
    rows[:N] = distances
    block = rows.reshape(-1)
    m_estimator.put_robust_weights(block, kind, N, 0, 2 * N, N)
    return block.reshape(-1, WIDTH)[N : 2 * N]


@pytest.mark.parametrize("kind", KINDS)
def test_the_weights_agree_with_the_norms(kind):
    """Beside so many marks at their place that the scale is the least one, 1."""
    u = np.array(STORED["u"])
    given = np.concatenate([np.zeros(len(u) + 1), u])[:, None]
    found = weights(given, KINDS[kind], 1.0)
    np.testing.assert_array_equal(found, found[:, :1].repeat(WIDTH, 1))
    np.testing.assert_allclose(
        found[len(u) + 1 :, 0], STORED["weights"][kind], rtol=1e-13, atol=1e-15
    )


@pytest.mark.parametrize("case", STORED["scales"], ids=lambda c: str(len(c["distances"])))
def test_the_scale_is_the_median_deviation_from_zero(case):
    """From the weights of Cauchy: w = 1 / (1 + (r / scale / c)^2)."""
    r = np.array(case["distances"])
    found = weights(r[:, None], m_estimator.CAUCHY, 1e-9)[r.argmax(), 0]
    scale = r.max() / m_estimator.CAUCHY_SCALE / np.sqrt(1 / found - 1)
    np.testing.assert_allclose(scale, case["scale"], rtol=1e-12)


def test_each_run_has_a_scale_of_its_own_of_the_marks_that_it_sees():
    rng = np.random.default_rng(3)
    r = np.abs(rng.normal(size=(9, WIDTH)))
    gone = rng.random(r.shape) < 0.4
    found = weights(np.where(gone, np.nan, r), m_estimator.HUBER, 0.01)
    for b in range(WIDTH):
        seen = ~gone[:, b]
        scale = m_estimator.NORMAL_SCALE * np.median(r[seen, b])
        wanted = np.minimum(1, m_estimator.HUBER_THRESHOLD * scale / r[seen, b])
        np.testing.assert_allclose(found[seen, b], wanted, rtol=1e-13)
        assert (found[gone[:, b], b] == 0.0).all()


@pytest.mark.parametrize("n", [*range(1, 18), 33, 100])
def test_rows_are_sorted_lane_by_lane(n):
    rows = np.random.default_rng(n).normal(size=(n, WIDTH))
    block = rows.reshape(-1).copy()
    m_estimator.sort_rows(block, 0, n)
    np.testing.assert_array_equal(block.reshape(n, WIDTH), np.sort(rows, axis=0))
