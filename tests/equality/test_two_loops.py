"""The compiled loop and the one for anybody's features and laws give the same bits."""

from itertools import product

import numpy as np
import pytest

import robsim as rs
from robsim.run import loop

SCHEMES = list(
    product(
        ("points", "pixels"),
        ("current", "desired", "mean"),
        ("true", "goal", 0.45),
        ("joint", rs.CameraLaw(0.01)),
        ("pseudo_inverse", rs.DampedInverse(0.05)),
    )
)


@pytest.mark.parametrize("scheme", SCHEMES, ids=str)
def test_both_loops_give_the_same_bits(scheme, puma_scene, puma_goal, puma_starts, monkeypatch):
    features, interaction, depth, law, inverse = scheme
    task = rs.IBVS(
        puma_goal,
        features=features,
        interaction=interaction,
        depth=depth,
        depth_scale=1.1,
        law=law,
        inverse=inverse,
        gain=2.0,
    )
    runs = []
    for compiled in (True, False):
        monkeypatch.setattr(loop, "worth_compiling", lambda runs, steps, answer=compiled: answer)
        runs.append(
            rs.simulate(
                puma_scene, task, puma_starts[:5], duration=0.6, sensing=rs.Sensing(noise=0.3)
            )
        )
    for name in runs[0].variables:
        np.testing.assert_array_equal(runs[0][name], runs[1][name], err_msg=name)
