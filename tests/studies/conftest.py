"""A camera that flies to a square, from starts that look at it."""

import pytest
from flying import TEXT

import robsim as rs
from robsim.units import cm, deg

START = rs.starts.LookAt("square", distance=(60 * cm, 1.5), roll=(-120, 120) * deg)
TASKS = [rs.IBVS(), rs.PBVS(), rs.Hybrid()]


@pytest.fixture(scope="session")
def flying():
    """An experiment of four seconds in 100 periods."""
    return rs.Experiment.from_text(TEXT)


@pytest.fixture(scope="session")
def how():
    """The values that differ from run to run: a start, a choice, a believed number and the task."""
    vary = {
        "task.gain": rs.samplers.Choice([0.5, 1.0, 2.0]),
        "belief.cameras.eye.focal": rs.samplers.Product(rs.samplers.Normal(1.0, 0.05)),
        "task": TASKS,
    }
    return {"start": START, "vary": vary, "seed": 7}
