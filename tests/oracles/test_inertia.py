"""The inertia of round solids against quadrature in 40 digits (generate_inertia.py)."""

import json
from pathlib import Path

import numpy as np
import pytest

import robsim as rs

STORED = json.loads((Path(__file__).parent / "inertia_mpmath.json").read_text())
CASES = [
    *((rs.shapes.Capsule, ("radius", "length"), case) for case in STORED["capsules"]),
    *(
        (rs.shapes.TaperedCylinder, ("radius", "end_radius", "length"), case)
        for case in STORED["tapered_cylinders"]
    ),
]


@pytest.mark.parametrize(
    ("kind", "sizes", "case"), CASES, ids=lambda x: x.__name__ if isinstance(x, type) else None
)
def test_volume_centre_and_moments_agree_with_the_integrals(kind, sizes, case):
    found = kind(*(case[size] for size in sizes), density=1.0).inertia
    assert found.mass == pytest.approx(case["volume"], rel=1e-15)
    np.testing.assert_allclose(
        found.centre, [0, 0, case["centre"]], rtol=0, atol=1e-15 * case["length"]
    )
    expected = np.diag([case["across"], case["across"], case["along"]])
    np.testing.assert_allclose(found.tensor, expected, rtol=2e-15)
