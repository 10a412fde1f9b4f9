"""A camera that turns beside its target, and is held back by the border of its image."""

import numpy as np

import robsim as rs

START = [0.25, -0.368, -0.481, -0.273, 0.252, 0.891, 0.26]


def make_border_case(*constraints, **settings):
    """PBVS of four marks within constraints, by default of the field of view and of the speeds."""
    given = constraints or (rs.constraints.FieldOfView(8.0), rs.constraints.JointSpeeds(0.08))
    case = rs.load_scenario(rs.examples.path("visp_tutorial")).at("task.kind", "pbvs")
    start = np.concatenate([START[:3], np.divide(START[3:], np.linalg.norm(START[3:]))])
    case = case.at("task.law", rs.laws.ConstrainedLaw(given))
    return case.with_(start=start, **{"duration": 6.0, **settings})


def list_acting(run, variable, instant):
    """The names of the constraints with a positive number at an instant of a run."""
    values = run[variable].values[instant]
    return [str(name) for name, x in zip(run["constraint"].values, values, strict=True) if x > 0]
