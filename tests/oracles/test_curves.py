"""Curves and chords on them against 40 digits (generate_curves.py)."""

import json
from pathlib import Path

import numpy as np
import pytest

import robsim as rs
from robsim.kernels.formulas import plane_curves

STORED = json.loads((Path(__file__).parent / "curves_mpmath.json").read_text())


@pytest.mark.parametrize("case", STORED["catenaries"], ids=lambda c: f"{c['length']} m")
def test_a_catenary_agrees_with_its_equation(case):
    cable = rs.shapes.curves.Catenary(case["start"], case["end"], case["length"])
    slack = cable.length / np.hypot(*np.subtract(case["end"], case["start"])) - 1
    # a depends on the slack, which is known to one part in 1e16 of the length
    loss = 2e-16 / slack
    np.testing.assert_allclose(cable.parameter, case["parameter"], rtol=4e-15 + loss)
    for s, x, y, direction, curvature in case["points"]:
        T = cable.at(s)
        size = 1e-15 * cable.length + 2 * loss * abs(y)
        np.testing.assert_allclose(T.position, [x, y, 0], rtol=0, atol=2e-15 + size)
        found = np.arctan2(T.rotation[1, 0], T.rotation[0, 0])
        assert abs(found - direction) < 1e-14 + 1e-15 * case["length"] / case[
            "parameter"
        ] + loss * abs(direction)
        np.testing.assert_allclose(cable.curvature(s), curvature, rtol=2e-14 + loss)
    np.testing.assert_allclose(cable.at(cable.length).position[:2], case["end"], atol=1e-12)


@pytest.mark.parametrize("case", STORED["chords"], ids=lambda c: f"{c['curve']} {c['s']:.2f}")
def test_a_chord_agrees_with_the_search(case):
    if case["curve"] == "arc":
        way = rs.shapes.curves.Arc(case["radius"], case["angle"])
    else:
        way = rs.shapes.curves.Catenary(case["start"], case["end"], case["cable"])
    for gives, at, expected in [
        (plane_curves.ARC, case["length"], case["arc"]),
        (plane_curves.ANGLE, case["length"], case["turn"]),
        (plane_curves.ARC, case["at"], case["third"]),
        (plane_curves.HEIGHT, case["at"], case["height"]),
        (plane_curves.TILT, case["at"], case["tilt"]),
    ]:
        found, _ = plane_curves.chord_quantity(
            way.constants, 0, case["s"], case["length"], case["wheel"], at, gives
        )
        assert abs(found - expected) < 2e-14
