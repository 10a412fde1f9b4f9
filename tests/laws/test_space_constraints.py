"""Constraints of space: their rows are the derivatives of distances, by finite differences."""

from itertools import product

import numpy as np
import pytest

import robsim as rs
from robsim.kernels.images import projection
from robsim.kernels.machine.program import Blocks, Program
from robsim.servo.camera_target import CameraTarget
from robsim.servo.constraints.clearance import Clearance
from robsim.servo.constraints.constraint import ConstraintInputs, ConstraintPlace, MarkView
from robsim.servo.constraints.half_space import HalfSpace
from robsim.servo.constraints.line_of_sight import LineOfSight
from robsim.servo.constraints.workspace_box import WorkspaceBox
from robsim.servo.controller_rows import ControllerInputs, add_image
from robsim.servo.frame_rows import add_body_poses

DT = 0.02
MARKS = np.array([[-0.1, -0.08, 0.0], [0.1, -0.1, 0.02], [0.09, 0.1, 0.0], [-0.1, 0.09, 0.03]])
EYE = rs.Camera([[500, 0, 319.5], [0, 500, 239.5], [0, 0, 1]], size=(640, 480))


def seen_object(name="plate", **where):
    return rs.Object(name, marks=MARKS, **where)


def arm_scene(post=(0.45, 0.1, 0.35)):
    post = rs.Object("post", marks=[[0, 0, 0]], pose=rs.Pose.at(*post))
    plate = seen_object(pose=rs.Pose.at(0.5, 0, 0.05, rpy=(np.pi, 0, 0)))
    camera = rs.MountedCamera("eye", EYE, on="panda.flange")
    return rs.Scene([rs.robots.panda()], [plate, post], [camera])


def base_scene():
    camera = rs.MountedCamera("eye", EYE, on="mobile_arm.flange", pose=rs.Pose.at(0, 0, 0.05))
    post = rs.Object("post", marks=[[0, 0, 0]], pose=rs.Pose.at(0.8, -0.2, 0.6))
    return rs.Scene(
        [rs.robots.mobile_arm()], [seen_object(pose=rs.Pose.at(1, 0, 0.5)), post], [camera]
    )


def flying_scene(post=(0.1, 0.2, -0.3)):
    """A free camera, a target on a belt with a prescribed motion, and a post on it."""
    belt = rs.Robot(
        "belt",
        [rs.joints.Link("bed"), rs.joints.Link("pallet", "bed", rs.joints.Joint("prismatic"))],
    )
    camera = rs.MountedCamera("eye", EYE, on="free_camera.body")
    objects = [
        seen_object(on="belt.pallet", pose=rs.Pose.at(0.1, 0, 0)),
        rs.Object("post", marks=[[0, 0, 0]], on="belt.pallet", pose=rs.Pose.at(*post)),
    ]
    motion = rs.Motion("belt", lambda t: [0.05 + t])
    return rs.Scene([rs.robots.free_camera(), belt], objects, [camera], motions=[motion])


class Rows:
    """The rows of a constraint, at coordinates (B, nq)."""

    def __init__(self, scene, constraint):
        self.scene = scene
        sight = CameraTarget(scene, scene.camera(), scene.object("plate"))
        self.columns = np.flatnonzero(~scene.prescribed)
        place = ConstraintPlace(scene, (sight,), self.columns)
        self.names = constraint.label(place)
        self.program = program = Program()
        self.q, n, N = program.rows(scene.nq), self.columns.size, len(MARKS)
        inputs = ControllerInputs(program, program.constant(DT), DT, self.q, {})
        placed = add_body_poses(program, scene.tree, self.q)
        image = program.rows(N, 2), program.rows(N), program.rows(N)
        add_image(program, placed, sight, *image, of=projection.EACH_STATUS)
        camera = {"camera": program.each(EYE.rows), "lens": EYE.lens_kind}
        points = program.result(
            projection.normalise_mark_pixels, "points", N, 2, pixels=image[0], **camera
        )
        view = MarkView(sight, image[0], points, image[1], program.rows(6, n), None)
        views = {sight.key: view}
        rest = program.rows(n), program.rows(1, n)
        of = ConstraintInputs(inputs, scene, self.columns, placed, views, *rest)
        self.rows = constraint.stages(of)
        self.image = image

    def at(self, q, step=0):
        """Return C (B, m, n) and bound (B, m)."""
        blocks = Blocks(self.program, np.zeros(len(q), dtype=np.int64))
        blocks.put(self.q, np.ascontiguousarray(np.transpose(q)))
        for part in self.program.segments():
            part(blocks, step)
        return np.moveaxis(blocks.get(self.rows.C), 2, 0), blocks.get(self.rows.bound).T


def flow(scene, q, column, seconds):
    """Return coordinates (nq,) after unit velocity for some seconds."""
    v = np.zeros((scene.nv, 1))
    v[column] = 1.0
    moved = np.array(q)[:, None]
    scene.tree.flow(moved, v, seconds)
    return moved[:, 0]


def slope(scene, height, q, column, eps):
    each = [height(scene, flow(scene, q, column, sign * eps)) for sign in (1, -1)]
    return (each[0] - each[1]) / (2 * eps)


def origin(scene, name, q):
    return scene.pose(name, q).position


def plane_height(scene, q):
    return np.array([origin(scene, FRAME[scene.robots[0].name], q) @ [0.6, 0, 0.8] - 0.1])


def box_heights(scene, q):
    p = origin(scene, FRAME[scene.robots[0].name], q)
    return np.concatenate([p - [-1, -2, -3], [4, 5, 6] - p])


def segment_distance(a, b, c, d):
    """Return the least distance of segments ab and cd: of corners to segments, or the inside."""

    def from_point(p, one, other):
        u = other - one
        t = np.clip((p - one) @ u / max(u @ u, 1e-300), 0, 1)
        return np.linalg.norm(p - one - t * u)

    each = [from_point(p, c, d) for p in (a, b)] + [from_point(p, a, b) for p in (c, d)]
    A = np.column_stack([b - a, c - d])
    if np.linalg.matrix_rank(A) == 2:
        share = np.linalg.lstsq(A, c - a, rcond=None)[0]
        if ((share > 0) & (share < 1)).all():
            each.append(np.linalg.norm(A @ share - (c - a)))
    return min(each)


def clearance_height(scene, q):
    links = LINK[scene.robots[0].name]
    a, b = (origin(scene, name, q) for name in links)
    c, d = origin(scene, "post", q), origin(scene, "plate", q)
    return np.array([segment_distance(a, b, c, d) - 0.35])


def occlusion_heights(scene, q):
    T = scene.pose("plate", q).matrix
    marks = MARKS @ T[:3, :3].T + T[:3, 3]
    eye, post = origin(scene, "eye", q), origin(scene, "post", q)
    return np.array([segment_distance(eye, mark, post, post) - 0.05 for mark in marks])


FRAME = {"panda": "panda.flange", "mobile_arm": "mobile_arm.flange", "free_camera": "eye"}
LINK = {
    "panda": ("panda.link4", "panda.flange"),
    "mobile_arm": ("mobile_arm.shoulder", "mobile_arm.flange"),
    "free_camera": ("eye", "free_camera.body"),
}
SCENES = {"panda": arm_scene, "mobile_arm": base_scene, "free_camera": flying_scene}
KINDS = {
    "plane": (lambda robot: HalfSpace(FRAME[robot], (3, 0, 4), 0.1), plane_height),
    "box": (lambda robot: WorkspaceBox(FRAME[robot], (-1, -2, -3), (4, 5, 6)), box_heights),
    "clearance": (
        lambda robot: Clearance(
            LINK[robot][0], "post", 0.2, 0.1, 0.05, first_end=LINK[robot][1], second_end="plate"
        ),
        clearance_height,
    ),
    "occlusion": (lambda robot: LineOfSight("post", 0.05), occlusion_heights),
}


def some_coordinates(scene, rng):
    """Coordinates at which the marks lie in front of the camera."""
    while True:
        q = scene.home.copy()
        if scene.robots[0].name == "free_camera":
            q[2] -= 0.8
        q = q[:, None]
        scene.tree.flow(q, rng.uniform(-0.3, 0.3, (scene.nv, 1)), 1.0)
        if (scene.view(q[:, 0], points="plate").depth > 0.05).all():
            return q[:, 0]


CASES = list(product(SCENES, KINDS))


@pytest.mark.parametrize(("robot", "kind"), CASES, ids=["-".join(case) for case in CASES])
@pytest.mark.few(4)
def test_rows_are_the_derivatives_of_the_distance_by_the_commanded_velocities(robot, kind):
    make, height = KINDS[kind]
    scene, rng = SCENES[robot](), np.random.default_rng(len(kind))
    rows = Rows(scene, make(robot))
    q = np.array([some_coordinates(scene, rng) for _ in range(6)])
    C, _ = rows.at(q)
    assert C.shape == (6, len(rows.names), len(rows.columns))
    for i, j in product(range(6), range(len(rows.columns))):
        slopes = [slope(scene, height, q[i], rows.columns[j], eps) for eps in (6e-4, 3e-4)]
        best = (4 * slopes[1] - slopes[0]) / 3  # Richardson: the second order cancels
        np.testing.assert_allclose(C[i, :, j], best, rtol=0, atol=1e-8)
        errors = np.abs(np.array(slopes) - C[i, :, j])
        falls = errors[0] > 1e-8
        np.testing.assert_allclose(errors[0][falls] / errors[1][falls], 4.0, rtol=0.02)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("rate", [4.0, 1e3])
def test_the_bound_is_the_rate_of_decay_less_the_rate_of_the_world(kind, rate):
    """A target on a belt moves with 5 cm/s and faster; the rate is at most 1/dt."""
    make, height = KINDS[kind]
    scene = flying_scene()
    one = make("free_camera")
    vars(one).update(rate=rate)
    rows, q = Rows(scene, one), some_coordinates(scene, np.random.default_rng(3))
    _, bound = rows.at([q], step=10)
    belt, h = scene.nv - 1, height(scene, q)
    drift = slope(scene, height, q, belt, 1e-4) * (0.05 + 10 * DT)
    np.testing.assert_allclose(bound[0], -min(rate, 1 / DT) * h - drift, atol=1e-8)
    assert (drift.any()) == (kind in ("clearance", "occlusion"))


def test_a_body_behind_the_mark_or_the_camera_does_not_hide_it():
    for z, far in ((-0.3, False), (1.0, True), (-2.0, True)):  # of the post, in axes of the belt
        moved = flying_scene(post=(0.1, 0, z))
        rows = Rows(moved, LineOfSight("post", 0.05))
        q = moved.home.copy()
        q[:3] = 0.1, 0, -0.8
        h = -rows.at([q])[1][0] / 4.0
        assert (h > 0.5).all() == far, h


def test_rows_of_a_mark_without_image_bound_nothing():
    rows = Rows(flying_scene(), LineOfSight("post", 0.05))
    blocks = Blocks(rows.program, np.zeros(1, dtype=np.int64))
    blocks.put(rows.q, np.r_[0.1, 0, 0.8, 0, 0, 0, 1, 0.0][:, None])  # behind the camera
    for part in rows.program.segments():
        part(blocks, 0)
    assert (blocks.get(rows.rows.bound) == -np.inf).all()
    assert (blocks.get(rows.rows.C) == 0).all()


def test_bodies_that_meet_in_a_point_are_separated_along_z():
    tip = arm_scene().pose("panda.flange", rs.robots.panda().home).position
    scene = met = arm_scene(post=tip)
    C, bound = Rows(met, Clearance("post", "panda.flange", 0.1)).at([scene.home])
    up = scene.tree.jacobian(scene.tree.bodies(scene.home[:, None]), "panda.flange")[2, :, 0]
    np.testing.assert_allclose(C[0, 0], up, atol=1e-12)
    np.testing.assert_allclose(bound[0], 0.4, rtol=1e-6)


WRONG = {
    "no frame": (HalfSpace("panda.tip", (0, 0, 1)), "no frame 'panda.tip'.*panda.flange"),
    "fixed": (HalfSpace("post", (0, 0, 1)), "no commanded joint moves frame 'post'"),
    "a fixed box": (WorkspaceBox("post", (0, 0, 0), (1, 1, 1)), "no commanded joint moves"),
    "no second": (Clearance("panda.flange", "pots", 0.1), "no frame 'pots'; .*post"),
    "both fixed": (Clearance("plate", "post", 0.1), "no commanded joint moves 'plate' relative"),
    "on one body": (Clearance("panda.flange", "eye", 0.1), "no commanded joint moves"),
    "no body": (LineOfSight("cup", 0.1), "no frame 'cup'"),
    "no camera": (LineOfSight("post", 0.1, camera="ear"), "the task has no camera 'ear'.*eye"),
}


@pytest.mark.parametrize(("one", "message"), WRONG.values(), ids=WRONG)
def test_wrong_frames_are_named(one, message):
    with pytest.raises(rs.errors.InputError, match=message):
        Rows(arm_scene(), one)


def test_wrong_values_are_refused():
    with pytest.raises(rs.errors.InputError, match="normal must not be zero"):
        HalfSpace("panda.flange", (0, 0, 0))
    with pytest.raises(rs.errors.InputError, match="low must be below high"):
        WorkspaceBox("panda.flange", (0, 0, 0), (1, 0, 1))
