"""Inertia in scenario files: the mass of a robot."""

import numpy as np

from robsim import examples
from robsim.run.experiment import Experiment

ARM = """
[[robots]]
name = "arm"
[[robots.links]]
name = "base"
[[robots.links]]
name = "plate"
shapes = [{ kind = "ball", radius = "10 cm", density = "3 g/cm^3" }]
[[robots.links]]
name = "tool"
[robots.links.inertia]
mass = "2 kg"
centre = "0, 0, 1 cm"
moments = "1, 2, 2.5 kg m^2"
products = "1, 2, 3 g cm^2"
"""


def test_masses_densities_and_inertias_are_read():
    text = examples.path("chapter_6_1").read_text(encoding="utf-8")
    _, plate, tool = Experiment.from_text(text + ARM).scene.robot("arm").links
    assert plate.shapes[0].density == 3000.0 and plate.inertia is None
    np.testing.assert_allclose(plate.inertial.mass, 4000 * np.pi * 1e-3, rtol=1e-15)
    assert tool.inertia.mass == 2.0 and tool.inertia.centre.tolist() == [0, 0, 0.01]
    assert tool.inertia.tensor.tolist() == [[1, 1e-7, 2e-7], [1e-7, 2, 3e-7], [2e-7, 3e-7, 2.5]]
