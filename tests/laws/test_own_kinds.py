"""A compiled feature, law or joint of one's own is one file with its kernel, and nothing else."""

import json
import os
import shutil
import subprocess
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest

import robsim as rs
from robsim import examples
from robsim.declare import families
from robsim.testing import check_feature, check_law

ANGLES = '''
"""Angles of the ray to each mark about two axes of the camera."""

import math
from dataclasses import dataclass

from robsim.declare import DeclaredValue, register
from robsim.features.compiled_feature import CompiledFeature
from robsim.features.feature import Tolerance
from robsim.kernels.formulas.interaction import points_interaction
from robsim.kernels.machine.array_views import matrix, vector
from robsim.kernels.machine.stages import stage


@stage
def angles(w, step, N="count", points="N, 2", depth="N", s="2*N", L="2*N, 6"):
    """Compute s = (atan x, atan y) and L of N marks."""
    x, s, L = matrix(w, points, N, 2), vector(w, s, 2 * N), matrix(w, L, 2 * N, 6)
    points_interaction(x, vector(w, depth, N), L)
    for n in range(2 * N):
        for b in range(x.shape[2]):
            t = x[n // 2, n % 2, b]
            s[n, b] = math.atan(t)
            for c in range(6):
                L[n, c, b] /= 1.0 + t * t


@register("feature", "angles")
@dataclass(frozen=True, eq=False)
class Angles(CompiledFeature, DeclaredValue):
    """The angles of the ray to each mark."""

    tolerance: Tolerance = 1e-5
    unit: str = "rad"

    def stages(self, seen):
        rows = seen.room(2 * seen.N)
        given = {"points": seen.points, "depth": seen.depth}
        seen.program.add(angles, **given, s=rows.s, L=rows.L)
        return rows
'''
SMOOTH = '''
"""A law whose joint velocities stay below a bound."""

from dataclasses import dataclass
from typing import Annotated, ClassVar

from robsim.declare import DeclaredValue, Number, register
from robsim.kernels.machine.lanes import absolute, get, put
from robsim.kernels.machine.stages import stage
from robsim.servo.laws.inverse import SAME_UNITS, add_inverse
from robsim.servo.laws.compiled_law import CompiledLaw


@stage
def bounded(w, step, n="count", gain="row", most="row", x="n", found="n"):
    """Compute -gain x / (1 + |gain x| / most) of n numbers."""
    for i in range(n):
        v = get(w, gain) * get(w, x + i)
        put(w, found + i, -v / (1.0 + absolute(v) / get(w, most)))


@register("law", "smooth")
@dataclass(frozen=True)
class Smooth(CompiledLaw, DeclaredValue):
    """A law whose joint velocities stay below a bound."""

    most: Annotated[float, Number(above=0), "Bound in rad/s or m/s."] = 1.0
    in_camera: ClassVar[bool] = False

    def stages(self, of):
        program, most = of.program, of.program.constant(self.most)
        moves = of.J if of.one_motion else SAME_UNITS
        unit = add_inverse(program, of.A, of.error, of.inverse, moves)

        def at(gain):
            found = program.rows(of.n)
            program.add(bounded, gain=gain, most=most, x=unit, found=found)
            return found

        return at
'''

GEARED = '''
"""A screw behind a gear."""

from dataclasses import dataclass
from typing import Annotated, ClassVar

from robsim.declare import DeclaredValue, Length, Number, register
from robsim.kernels.formulas.lane_math import cos_sin
from robsim.kernels.machine.lanes import get, put
from robsim.kernels.machine.stages import stage
from robsim.robot.joints.joint_kind import JointKind


@stage
def place(w, step, q="1", numbers="2", motion="3, 4", twists="1, 6"):
    """Compute motion and twist at an angle, from the numbers lead and ratio."""
    q, lead, ratio, T, V = get(w, q), get(w, numbers), get(w, numbers + 1), motion, twists
    c, s = cos_sin(q)
    for r in range(12):
        put(w, T + r, 0.0 * q)
    put(w, T, c)
    put(w, T + 1, -s)
    put(w, T + 4, s)
    put(w, T + 5, c)
    put(w, T + 10, 1.0 + 0.0 * q)
    put(w, T + 11, lead * q)
    for r in range(6):
        put(w, V + r, 0.0 * q)
    put(w, V + 2, lead / ratio)
    put(w, V + 5, 1.0 / ratio)


@stage
def move(w, step, dt="row", q="1", v="1", numbers="2"):
    """Turn the screw by the velocity of the motor."""
    put(w, q, get(w, q) + get(w, dt) * get(w, v) / get(w, numbers + 1))


@register("joint kind", "geared")
@dataclass(frozen=True)
class Geared(JointKind, DeclaredValue):
    """A screw behind a gear."""

    name: ClassVar[str] = "geared"
    coordinates: ClassVar[tuple[str, ...]] = ("",)
    units: ClassVar[tuple[str, ...]] = ("rad",)
    placing: ClassVar = place
    moving: ClassVar = move
    lead: Annotated[float, Length(), "Metres for each radian."] = 0.02
    ratio: Annotated[float, Number(above=0), "Turns of the motor for each turn."] = 2.0
'''


@dataclass(frozen=True)
class GearedInPython(rs.joints.JointKind):
    name: ClassVar[str] = "geared_in_python"
    coordinates: ClassVar[tuple[str, ...]] = ("",)
    units: ClassVar[tuple[str, ...]] = ("rad",)
    lead: float = 0.02
    ratio: float = 2.0

    def motion(self, q):
        T = np.tile(np.eye(4), (len(q), 1, 1))
        T[:, 0, 0] = T[:, 1, 1] = np.cos(q[:, 0])
        T[:, 1, 0], T[:, 0, 1] = np.sin(q[:, 0]), -np.sin(q[:, 0])
        T[:, 2, 3] = self.lead * q[:, 0]
        return T

    def twists(self, q):
        return np.tile([0, 0, self.lead / self.ratio, 0, 0, 1 / self.ratio], (len(q), 1, 1))

    def integrate(self, q, v, dt):
        return q + v * dt / self.ratio


class AnglesInPython:
    unit, tolerance = "rad", 1e-5

    def measure(self, seen):
        return np.arctan(seen.points).reshape(len(seen.points), -1)


class SmoothInPython:
    def __init__(self, most):
        self.most = most

    def command(self, state):
        wish = rs.laws.JointLaw().command(state)
        return wish / (1.0 + np.abs(wish) / self.most)


@pytest.fixture(scope="module")
def own(tmp_path_factory):
    """A package of its own with a feature, a law and a joint, each in one file."""
    folder = tmp_path_factory.mktemp("package")
    (folder / "own_kinds").mkdir()
    for name, text in (
        ("__init__", ""),
        ("angles", ANGLES),
        ("smooth", SMOOTH),
        ("geared", GEARED),
    ):
        (folder / "own_kinds" / f"{name}.py").write_text(text)
    sys.path.insert(0, str(folder))
    try:
        import own_kinds.angles
        import own_kinds.geared
        import own_kinds.smooth

        yield own_kinds
    finally:
        sys.path.remove(str(folder))
        for noun, name in (("feature", "angles"), ("law", "smooth"), ("joint kind", "geared")):
            families()[noun].loaded.pop(name, None)


@pytest.fixture
def experiment():
    return rs.load_scenario(examples.path("eye_in_hand")).with_(duration=2.0)


def runs_of(experiment, **task):
    goal = experiment.task.goal
    several = experiment.start + 0.01 * np.arange(3)[:, None]
    return experiment.with_(task=rs.IBVS(goal=goal, **task), start=several)


def same(compiled, called, atol):
    """Whether two experiments run alike, the first without a call of Python in its steps."""
    assert compiled.loop().sequence.compiled and not called.loop().sequence.compiled
    first, second = compiled.run(), called.run()
    np.testing.assert_allclose(first.q, second.q, atol=atol, rtol=0)
    np.testing.assert_array_equal(first.outcome, second.outcome)
    assert (first.outcome == rs.Outcome.TIME_LIMIT).all() or atol < 1e-6


def read_again(experiment, *words):
    """Whether the text of an experiment has some words, and is of an equal experiment."""
    text = experiment.to_toml(complete=True)
    assert [word for word in words if word not in text] == [], text
    for each in (text, experiment.to_toml()):
        assert rs.Experiment.from_text(each) == experiment


def test_a_feature(own, experiment):
    kind = own.angles.Angles
    assert check_feature(kind(), bits=True) == []
    same(
        runs_of(experiment, features=kind()),
        runs_of(experiment, features=AnglesInPython()),
        1e-7,  # L of the second one is found by moving the camera a little
    )
    made = runs_of(experiment, features="angles").of_run(0)
    read_again(made, '"angles"')
    assert made.at("task.features.tolerance", 1e-3).task.features == kind(1e-3)


def test_a_law(own, experiment):
    kind = own.smooth.Smooth
    assert check_law(kind(0.5)) == []
    same(runs_of(experiment, law=kind(0.2)), runs_of(experiment, law=SmoothInPython(0.2)), 1e-12)
    made = runs_of(experiment, law=kind(0.2)).of_run(0)
    read_again(made, 'kind = "smooth"', "most = 0.2")
    assert made.at("task.law.most", 0.3).task.law == kind(0.3)
    with pytest.raises(rs.errors.InputError, match=r"task.law.most.*positive|must be"):
        made.at("task.law.most", -1.0)


def on_a_screw(experiment, kind):
    """The experiment with a joint of a kind instead of the last one of its arm."""
    (robot,) = experiment.scene.robots
    at = max(i for i, link in enumerate(robot.links) if link.joint.kind == "revolute")
    old = robot.links[at]
    own = replace(old, joint=rs.joints.Joint(kind, old.joint.place, old.joint.tail))
    links = [own if link is old else link for link in robot.links]
    scene = replace(experiment.scene, robots=[replace(robot, links=links)])
    return experiment.with_(scene=scene)


def test_a_joint(own, experiment):
    kind = own.geared.Geared
    compiled = on_a_screw(experiment, kind(0.02, 3.0))
    called = on_a_screw(experiment, GearedInPython(0.02, 3.0))
    robots = [each.scene.robots[0] for each in (compiled, called)]
    q = np.random.default_rng(0).uniform(-1, 1, (20, robots[0].nq))
    for name in ("fk", "jacobian"):
        found, wanted = (getattr(robot, name)(q) for robot in robots)
        np.testing.assert_allclose(found, wanted, atol=1e-14)
    moved = [robot.integrate(q, np.ones(robot.nv), 0.5) for robot in robots]
    np.testing.assert_allclose(*moved, atol=1e-15)
    found = robots[0].ik(robots[0].fk(q[0]), q0=q[0] + 0.1)
    assert found.success and compiled.scene.tree.compiled and not called.scene.tree.compiled
    same(*(runs_of(each) for each in (compiled, called)), 1e-11)
    read_again(compiled, 'kind = "geared"')


def test_a_compiled_joint_that_cannot_move_is_refused(own):
    @dataclass(frozen=True)
    class Stuck(own.geared.Geared):
        straight: ClassVar[bool] = False
        moving: ClassVar = None

    with pytest.raises(rs.errors.InputError, match=r"Stuck.moving: expected the stage that moves"):
        rs.joints.Joint(Stuck())


SWAY = '''
"""Joints that slide along y."""

from dataclasses import dataclass

from robsim.declare import register
from robsim.kernels.formulas.lane_poses import compose_lanes
from robsim.kernels.machine.lanes import get, put
from robsim.kernels.machine.stages import stage
from robsim.robot.joints.joint_kind import JointKind


@stage
def sway(w, step, each="each: parent=3, 4; place=3, 4; x=row; T=3, 4"):
    """Place bodies that slide along y."""
    for i in range(each[0]):
        A, B, x, T = each[4 * i + 1], each[4 * i + 2], each[4 * i + 3], each[4 * i + 4]
        compose_lanes(w, A, B, T)
        for r in range(0, 12, 4):
            put(w, T + r + 3, get(w, T + r + 3) + get(w, T + r + 1) * get(w, x))


@register("joint kind", "sway")
@dataclass(frozen=True)
class Sway(JointKind):
    """A joint that slides along y."""

    name = "sway"
    coordinates = ("",)
    units = ("m",)
    moves = ((False, 1),)
    fused = sway
'''
IGNORED = shutil.ignore_patterns("__pycache__")
ADDED = {
    "features/angles.py": ANGLES,
    "servo/laws/smooth.py": SMOOTH,
    "robot/joints/geared.py": GEARED,
    "robot/joints/sway.py": SWAY,
}
SHIPPED = """
import json, os, runpy, sys
sys.path.insert(0, os.path.dirname(sys.argv[1]))  # docs/build.py imports its neighbours
import robsim.features
import robsim as rs
from robsim.cli.warm_workload import list_workload
pages = runpy.run_path(sys.argv[1])
askew = rs.joints.Joint("sway", rs.Pose.at(rpy=(0, 0, 0.5)))
crab = rs.Robot("crab", [rs.joints.Link("base"), rs.joints.Link("crab", "base", askew)])
print(json.dumps({
    "file": rs.__file__,
    "kinds": "".join(pages["write_kinds"]().values()),
    "scenario": pages["scenario"](),
    "uses": list_workload(),
    "room": robsim.features.Angles.__name__,
    "swayed": crab.fk(crab.integrate([0.1], [1.0], 0.2))[:3, 3].tolist(),
    "sways": crab.jacobian([0.1])[:, 0].tolist(),
    "found": bool(crab.ik(crab.fk([0.3])).success),
}))
changes = ["task.features=angles", "task.law={kind='smooth', most=0.2}", "run.duration=0.4 s"]
loop = rs.load_scenario(rs.examples.path("eye_in_hand"), changes).loop()
assert loop.sequence.compiled
"""


@pytest.mark.full  # it copies the package
def test_a_kind_of_ours_is_one_file_too(tmp_path):
    """In a copy of RobSim with these files: no page or table is written by hand."""
    copy = shutil.copytree(Path(rs.__file__).parent, tmp_path / "robsim", ignore=IGNORED)
    for name, text in ADDED.items():
        (copy / name).write_text(text)
    build = Path(__file__).parents[2] / "docs" / "build.py"
    done = subprocess.run(
        [sys.executable, "-c", SHIPPED, build],
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert Path(found["file"]).is_relative_to(tmp_path) and found["room"] == "Angles"
    y = np.array([-np.sin(0.5), np.cos(0.5), 0.0])
    np.testing.assert_allclose(found["swayed"], 0.3 * y, atol=1e-15)
    np.testing.assert_allclose(found["sways"], [*y, 0, 0, 0], atol=1e-15)
    assert found["found"]
    for name in ("angles", "smooth", "geared", "sway"):
        assert f"## `{name}`\n" in found["kinds"] and f'"{name}"' in found["scenario"]
    changes = [change for kind, change in found["uses"] if kind == "change"]
    assert {"task.features=angles", "task.law=smooth"} <= set(changes)
