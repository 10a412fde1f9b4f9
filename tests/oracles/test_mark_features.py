"""Features of marks and their interaction matrices against 40 digits of mpmath."""

import json
from pathlib import Path

import numpy as np
import pytest

import robsim as rs
from robsim.features.feature import FEATURES

STORED = json.loads((Path(__file__).parent / "mark_features_mpmath.json").read_text())["cases"]


@pytest.mark.parametrize("name", sorted({case["feature"] for case in STORED}))
def test_features_and_their_derivatives_agree_with_40_digits(name):
    feature = FEATURES.find(name)()
    for case in (c for c in STORED if c["feature"] == name):
        seen = rs.features.Observation.of(case["x"], case["Z"], rs.Camera(np.eye(3)))
        L = np.array(case["L"])
        np.testing.assert_allclose(feature.measure(seen)[0], case["s"], rtol=1e-14, atol=1e-15)
        error = np.abs(feature.interaction(seen)[0] - L) / np.abs(L).max(axis=1, keepdims=True)
        assert error.max() < 5e-15, case["kind"]
