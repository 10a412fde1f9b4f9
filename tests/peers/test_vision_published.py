"""The suite with detectors in pictures: keypoints of OpenCV."""

from dataclasses import replace

import numpy as np

import robsim as rs
from robsim.suites.published import vit_500_images


def test_keypoints_lead_to_the_goal_plain_and_perturbed():
    suite = vit_500_images.suite()
    runs = np.flatnonzero(suite.draws % 500 == 0)
    few = replace(
        suite,
        starts=suite.starts[runs],
        varied={name: values[runs] for name, values in suite.varied.items()},
        groups={"picture": [suite.groups["picture"][i] for i in runs]},
        draws=suite.draws[runs],
        schemes={"IBVS, keypoints": suite.schemes["IBVS, keypoints"]},
    )
    rows = rs.bench(few).data
    assert len(rows) == 2 and rows["success"].all()
    assert set(rows["outcome"]) == {"converged"} and rows["distance_to_goal"].max() < 5e-3
