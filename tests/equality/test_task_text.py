"""Task -> text -> task for every task and option: equal values, and runs of the same bits."""

import dataclasses
import re
from itertools import pairwise

import numpy as np
import pytest
from painting import GOAL, make_scene, place_camera

import robsim as rs
from robsim.declare import family
from robsim.run.experiment import Experiment
from robsim.run.replay import replay
from robsim.servo.tasks.docking_task import Docking
from robsim.servo.tasks.placing_task import Placing
from robsim.trajectory import Blends, Path, Quintic, Straight, Trapezoid

pytestmark = pytest.mark.filterwarnings("ignore::robsim.base.errors.RankWarning")
FEATURES = family("feature").kinds
RING = np.array([0.1, 0.7, 1.3, 2.4, 3.0, 3.3, 4.6, 5.5])  # angles of marks on a circle
MARKS = 0.15 * np.stack([np.cos(RING), np.sin(RING), 0 * RING], axis=1)
LENS = rs.Camera([[500, 0, 320], [0, 500, 240], [0, 0, 1]], size=(640, 480))
NEAR = rs.GoalPose(rs.Pose.at(0.01, 0.02, 1, rpy=(0.1, -0.2, 0.05)))


def again(scene, task, **settings):
    """The task of the text of a scenario; the scene must come back as well."""
    scenario = Experiment(scene, task, **settings)
    text = scenario.to_toml()
    read = Experiment.from_text(text)
    assert read.scene == scene and read.settings == scenario.settings
    assert read.to_toml() == text
    return read.task


def flying(*more, motions=()):
    """A flying camera before marks that a conveyor carries."""
    eye = rs.MountedCamera("eye", LENS, on="free_camera.body")
    belt = rs.robots.conveyor().at(rs.Pose.at(0, 0, 1))
    dots = rs.Object("dots", marks=MARKS, on=f"conveyor.{belt.tip}")
    return rs.Scene([rs.robots.free_camera(), belt], [dots, *more], [eye], motions)


MOVING = rs.Motion("conveyor", [1 / 30])
FLOWN = 7  # velocities of the camera and the conveyor
JUST_FLYING = {"joints": "free_camera"}


# values


def pick(rng, *choices):
    return choices[rng.integers(len(choices))]


def any_feature(rng):
    made = pick(
        rng, *(kind() for kind in FEATURES.values()), rs.features.Sphere(rng.uniform(0.01, 1))
    )
    if rng.integers(2):
        made = dataclasses.replace(made, tolerance=rng.uniform(0, 1))
    choices = [
        made,
        rs.features.DecoupledMoments("region"),
        rs.features.Translation("camera", tolerance=1 / 3),
    ]
    return pick(rng, *choices, made, made)


def any_part(rng):
    return rs.features.FeatureBlock(
        any_feature(rng),
        camera=pick(rng, None, "eye", ("eye", "wall")),
        target=pick(rng, None, "dots"),
        marks=pick(rng, None, [2, 0], np.array([1])),
        components=pick(rng, None, (0,), [1, 3]),
        weight=pick(rng, 1, rng.uniform(0.1, 3)),
    )


def any_shaping(rng, n):
    """The joints are left out: priorities have them as a whole."""
    limits = [
        None,
        rs.laws.SpeedLimit(joint=rng.uniform(0.1, 1)),
        rs.laws.SpeedLimit(linear=0.1, angular=1),
    ]
    return {
        "smooth_start": pick(rng, None, rng.uniform(0.1, 9)),
        "limit": pick(rng, *limits, rs.laws.SpeedLimit(joint=rng.uniform(0.1, 1, n))),
    }


def any_redundancy(rng, n):
    secondary = [
        rs.laws.AvoidLimits(rng.uniform(0.1, 2), rng.uniform(0, 0.5)),
        rs.laws.AvoidLimits(),
    ]
    secondary.append(rs.laws.Posture(rng.normal(size=n), rng.uniform(0.1, 1)))
    large = rs.laws.LargeProjection(0.1, rng.uniform(0.2, 1))
    projection = pick(rng, "classic", "large", large)
    return pick(rng, {}, {"secondary": pick(rng, *secondary), "projection": projection})


def any_aim(rng, scene, belief):
    return {
        "goal": pick(rng, None, scene.home, NEAR),
        "camera": pick(rng, "eye", ("wall", "eye")),
        "target": pick(rng, None, "dots"),
        "tolerance": pick(rng, None, rng.uniform(1e-6, 1e-3)),
        "belief": belief,
    }


def any_depth(rng, measured):
    """`measured` for features that are made of the depth itself."""
    filtered = rs.laws.DepthFilter(0.3, rng.uniform(0.1, 1), rng.uniform(0.1, 1))
    assumed = [] if measured else ["goal", rng.uniform(0.1, 2)]
    return {"depth": pick(rng, "true", filtered, *assumed), "depth_scale": rng.uniform(0.5, 2)}


def any_gain(rng):
    adaptive = rs.laws.AdaptiveGain(4, 0.4, rng.uniform(1, 50), of=pick(rng, "error", "command"))
    return {"gain": pick(rng, rng.uniform(0.1, 5), adaptive)}


def any_interaction(rng, *more):
    named = "current", "desired", "mean"
    return {"interaction": pick(rng, *named, rng.normal(size=(4, 6)), *more)}


def learns(interaction):
    return isinstance(interaction, rs.laws.Broyden) or str(interaction) == "broyden"


def any_law(rng, ordered):
    """Broyden's rule goes with the joint law, and the transpose without feed-forward."""
    rules = ["broyden", rs.laws.Broyden(rng.normal(size=(4, 7)))]
    law = "joint" if ordered else pick(rng, "joint", "camera", rs.laws.CameraLaw(0.01))
    made = {"law": law, **any_interaction(rng, *(rules if law == "joint" else []))}
    known, damped = rs.laws.PseudoInverse(1e-4), rs.laws.DampedInverse(1 / 7)
    if not ordered:
        made["inverse"] = pick(rng, "pseudo_inverse", known, "damped", damped, "transpose")
    learnt = learns(made["interaction"])
    if made.get("inverse") != "transpose":
        estimated = [] if learnt else ["estimated", rs.laws.EstimatedMotion(rng.uniform(0.1, 1))]
        made["feed_forward"] = pick(rng, None, "known", *estimated)
    return {**made, **any_gain(rng)}


def any_weighting(rng, made):
    """If no filter, rule or estimate prevents it."""
    learnt = learns(made.get("interaction"))
    estimated = made.get("feed_forward") not in (None, "known")
    if learnt or estimated or isinstance(made.get("depth"), rs.laws.DepthFilter):
        return {}
    several = [rs.weights.Border(rng.uniform(1, 90), 3), rs.weights.Fade(rng.uniform(0.1, 1))]
    return {"weighting": pick(rng, (), "border", several)}


def any_goal(rng, made):
    """Also numbers, if the task needs no image at the goal."""
    named = isinstance(made["interaction"], str) and made["interaction"] in ("desired", "mean")
    if named or made["depth"] == "goal":
        return {}
    return pick(rng, {}, {"goal": rs.GoalFeatures(rng.normal(size=5))})


def any_servo(rng, scene, belief, ordered=False):
    """A servo task; `ordered` as it may stand in priorities."""
    aim = any_aim(rng, scene, belief)
    shaping = {} if ordered else any_shaping(rng, FLOWN)
    if not ordered:
        shaping["joints"] = pick(rng, None, ["free_camera", "conveyor"])
    redundancy = {} if ordered else any_redundancy(rng, FLOWN)
    features = pick(rng, "points", any_feature(rng), any_part(rng), [any_part(rng), "lines"])
    speeds = dict(zip(("roll", "advance", "length"), rng.uniform(0.1, 2, 3), strict=True))
    rates = dict(zip(("rotation", "translation", "length"), rng.uniform(0.1, 2, 3), strict=True))
    variant = pick(rng, "corrected", "printed", "completed")

    def chosen(kind, deep, measured=False, **own):
        made = any_law(rng, ordered) | (any_depth(rng, measured) if deep else {})
        made |= any_weighting(rng, made)
        return kind(**{**aim, **shaping, **redundancy, **made, **own})

    def of_features():
        task = rs.IBVS(features=features)
        each = [block.feature for block in task.blocks]
        measured = any(getattr(one, "measures_depth", False) for one in each)
        posed = any(getattr(one, "uses_pose", False) for one in each)
        made = any_law(rng, ordered) | (any_depth(rng, measured) if task.needs_depth else {})
        goal = {} if posed else any_goal(rng, {"depth": "true", **made})
        made |= any_weighting(rng, made)
        return rs.IBVS(**{**aim, **shaping, **redundancy, **made, **goal}, features=features)

    own = {
        "inverse": pick(rng, "pseudo_inverse", rs.laws.PseudoInverse(1e-4)),
        **any_interaction(rng),
    }
    kinds = [
        of_features,
        lambda: chosen(rs.PBVS, deep=False, form=pick(rng, "goal", "camera")),
        lambda: chosen(rs.Hybrid, deep=True, measured=True, mark=int(rng.integers(4))),
        lambda: rs.Partitioned(
            segment=[3, 1],
            **{**aim, **shaping, **redundancy, **own, **speeds},
            **any_gain(rng),
            **any_depth(rng, measured=False),
        ),
        lambda: Placing(
            variant=variant, marks=[4, 2, 0], **{**aim, **shaping, **redundancy, **rates}
        ),
        lambda: Docking(
            turn=rng.uniform(1, 5),
            h=rng.uniform(1, 5),
            **{**aim, **shaping},
            **any_gain(rng),
            **any_weighting(rng, {}),
        ),
    ]
    return kinds[rng.integers(3 if ordered else 6)]()


def any_limits(rng, n):
    """One for all, or one for each."""
    each = [rng.uniform(0.1, 2), rng.uniform(0.1, 2, n)]
    return {"speed": pick(rng, *each), "acceleration": pick(rng, *each)}


def any_joints(rng):
    """Following a trajectory of joints of `any_scene`."""
    control = {"gain": pick(rng, None, rng.uniform(0.1, 9)), "tolerance": rng.uniform(1e-9, 1e-3)}
    pace = pick(rng, {"duration": rng.uniform(0.1, 9)}, any_limits(rng, 2))
    to = {"crane.lift": rng.uniform(0, 1), pick(rng, "turn", "crane.turn"): rng.normal()}
    names = ["crane.turn", "conveyor", "crane.lift"]
    points = rng.uniform(0, 0.5, (4, 3))
    limits = any_limits(rng, 3)
    corner = pick(rng, None, rng.uniform(0.01, 0.1), rng.uniform(0.01, 0.1, 3))
    trajectories = [
        Quintic(*points[:2], rng.uniform(0.1, 9)),
        Trapezoid(*points[:2], **limits),
        Blends(points, corner=corner, **limits),
    ]
    made = [
        lambda: rs.FollowJoints(to, **pace, **control),
        lambda: rs.FollowJoints(points[0, :2], joints="crane", **pace, **control),
        lambda: rs.FollowJoints(trajectory=pick(rng, *trajectories), joints=names, **control),
        lambda: rs.FollowJoints(by=to, **pace, **control),
    ]
    return made[rng.integers(4)]()


def any_pace(rng, turns=True):
    limits = dict(zip(("speed", "acceleration"), rng.uniform(0.1, 2, 2), strict=True))
    if turns:
        limits |= dict(zip(("turn", "turn_acceleration"), rng.uniform(0.1, 2, 2), strict=True))
    return pick(rng, {"duration": rng.uniform(0.1, 9)}, limits)


def any_path(rng, n):
    """Following a path of a frame of `any_scene`."""
    poses = [rs.Pose.at(*rng.normal(size=3), rotvec=rng.normal(size=3)) for _ in range(3)]
    several = [Straight(*pair, **any_pace(rng)) for pair in pairwise(poses)]
    position = {"to": poses[0].position, "mask": "position", **any_pace(rng, turns=False)}
    ways = [{"to": poses[0], **any_pace(rng)}, {"path": several[0]}, {"path": Path(several)}]
    return rs.FollowPath(
        frame=pick(rng, "eye", "free_camera.body"),
        inverse=pick(
            rng, "pseudo_inverse", rs.laws.PseudoInverse(1e-4), rs.laws.DampedInverse(1 / 7)
        ),
        gain=pick(rng, None, rng.uniform(0.1, 9)),
        tolerance=rng.uniform(1e-9, 1e-3),
        joints=pick(rng, None, ["free_camera"]),
        **pick(rng, position, *ways),
        **any_shaping(rng, n),
        **any_redundancy(rng, n),
    )


def any_scene():
    """With a second camera, which stands still, and a crane."""
    scene = flying()
    lift = rs.joints.Link("lift", "base", rs.joints.Joint("prismatic", limits=(0.0, 1.0)))
    turn = rs.joints.Link("turn", "lift", rs.joints.Joint("revolute"))
    crane = rs.Robot("crane", [rs.joints.Link("base"), lift, turn])
    cameras = [*scene.cameras, rs.MountedCamera("wall", LENS)]
    return dataclasses.replace(scene, robots=[*scene.robots, crane], cameras=cameras)


def any_task(rng, scene, depth=2, kinds=6):
    beliefs = [
        None,
        scene,
        scene.replacing(rs.MountedCamera("eye", LENS, "free_camera.body", NEAR.T_c_o)),
    ]
    shared = pick(rng, *beliefs)

    def servo(**ordered):
        if not ordered and rng.integers(5) == 0:
            return pick(rng, any_joints(rng), any_path(rng, 6))
        return any_servo(rng, scene, pick(rng, shared, shared, shared, *beliefs), **ordered)

    def inner(kinds):
        deep = depth > 1 and rng.integers(3) == 0
        return any_task(rng, scene, depth - 1, kinds) if deep else servo()

    kind = rng.integers(kinds)
    if kind == 5:
        return rs.Parallel([inner(6) for _ in range(rng.integers(2, 4))])
    if kind == 1:
        border = rs.tasks.NearBorder(rng.uniform(1, 50), (640, 480))
        when = pick(
            rng, rs.tasks.ErrorBelow(rng.uniform(0.1, 1), pick(rng, "first", "second")), border
        )
        return rs.Switch(inner(5), inner(5), when, latch=bool(rng.integers(2)))
    if kind == 2:
        shaping = any_shaping(rng, FLOWN) | any_redundancy(rng, FLOWN)
        tasks = [servo(ordered=True) for _ in range(rng.integers(2, 4))]
        return rs.Priorities(tasks, rcond=rng.uniform(1e-9, 1e-3), **shaping)
    return servo()


@pytest.mark.parametrize(
    "seeds", [range(15), pytest.param(range(15, 80), marks=pytest.mark.full)], ids=str
)
def test_any_task_comes_back_from_its_text(seeds):
    scene = any_scene()
    for seed in seeds:
        rng = np.random.default_rng(seed)
        task = any_task(rng, scene)
        assert again(scene, task, hold=bool(rng.integers(2))) == task, seed


@pytest.mark.parametrize("feature", FEATURES.values(), ids=list(FEATURES))
@pytest.mark.few(5)
def test_a_feature_alone_and_in_a_list_stay_as_they_are(feature):
    for features in (
        feature(),
        [feature()],
        [rs.features.FeatureBlock(feature(tolerance=0.3), marks=[0])] * 2,
    ):
        task = rs.IBVS(features=features)
        assert again(flying(), task) == task


@pytest.mark.parametrize(
    "seed", [*range(5), *(pytest.param(i, marks=pytest.mark.full) for i in range(5, 20))]
)
def test_any_mission_comes_back_from_its_text(seed):
    rng = np.random.default_rng(seed)
    scene = any_scene()
    phases = [
        rs.Phase(
            f"phase {i}",
            any_task(rng, scene),
            pick(rng, None, rng.uniform(1, 9)),
            expects=pick(rng, "converged", ["joint_limit", "time_limit"]),
        )
        for i in range(rng.integers(1, 4))
    ]
    assert again(scene, rs.Mission(phases)) == rs.Mission(phases)


def test_every_task_of_the_package_is_among_those_that_are_tried():
    kinds = {type(any_task(np.random.default_rng(seed), any_scene())) for seed in range(200)}
    assert kinds | {rs.Mission} == set(family("task").kinds.values())


def test_motions_come_back_and_a_belief_may_change_them():
    scene = flying(motions=[MOVING])
    task = rs.IBVS(belief=scene.replacing(rs.Motion("conveyor", [-0.0])), feed_forward="known")
    assert again(scene, task) == task
    assert np.signbit(again(scene, task).belief.motions[0].rates[0])


def test_a_shared_belief_is_reported_once():
    scene = flying()
    both = rs.Parallel([rs.PBVS(belief=flying(rs.Object("extra"))) for _ in range(2)])
    text = Experiment(scene, both).to_toml()
    assert text.count("complete = true") == 1 and "[belief]" in text
    one = rs.Parallel([rs.PBVS(belief=scene), rs.PBVS()])
    assert "belief = {}" in Experiment(scene, one).to_toml()
    text = Experiment(scene, one).to_toml(complete=True)
    assert text.count("complete = true") == 1 and "[task.tasks.belief]" in text
    assert again(scene, one) == one


# tasks that a file cannot hold


class Mine:
    unit, tolerance = "1", 0.1

    def measure(self, seen):
        return seen.points[:, 0]

    def holds(self, first, second):
        return first.error[:, 0] > 0

    def velocity(self, q, limits):
        return 0.0 * q


class Slow(rs.laws.AdaptiveGain):
    """Somebody's own."""


class Fast(rs.laws.SpeedLimit):
    """Somebody's own."""


@pytest.mark.parametrize(
    "task,reason",
    [
        (rs.IBVS(gain=Slow(3, 2, 1)), "Slow is Python code"),
        (rs.IBVS(limit=Fast(1)), "Fast is Python code"),
        (rs.IBVS(features=Mine()), "Mine is Python code"),
        (rs.IBVS(features=["points", rs.features.FeatureBlock(Mine())]), "Mine is Python code"),
        (rs.IBVS(secondary=Mine()), "Mine is Python code"),
        (rs.Switch(rs.IBVS(), rs.PBVS(), Mine()), "Mine is Python code"),
        (rs.Parallel([rs.IBVS(), rs.IBVS(features=Mine())]), "Mine is Python code"),
        (rs.IBVS(features=rs.features.Points(unit="mm")), "Points has a unit of its own"),
        (
            rs.IBVS(features=rs.features.ThetaU(T_goal_o=NEAR.T_c_o)),
            "ThetaU has a T_goal_o of its own",
        ),
        (
            rs.IBVS(secondary=rs.laws.Posture([1.0])),
            r"task.secondary.q is not one number for each of 7 joints",
        ),
    ],
)
def test_a_task_without_a_text_is_reported(task, reason):
    with pytest.raises(rs.errors.InputError, match=reason):
        Experiment(flying(), task).to_toml()


def test_a_lens_may_be_written_as_opencv_writes_it():
    """With a thin prism and a tilted sensor that are not there: 14 numbers."""
    eye = rs.MountedCamera("eye", rs.Camera(LENS.K, distortion=(0.1, 0, 0, 0)))
    text = Experiment(flying().replacing(eye), rs.IBVS()).to_toml()
    (short,) = re.findall(r"distortion = \[.*?\]", text, re.DOTALL)
    lens = [0.1, *[0] * 13]
    read = Experiment.from_text(text.replace(short, f"distortion = {lens}")).scene.camera("eye")
    assert read.camera.distortion == (0.1, *[0] * 7)
    np.testing.assert_array_equal(read.camera.coefficients, eye.camera.coefficients)


def test_a_camera_of_somebody_has_no_text():
    class Mirror(rs.Camera):
        """Somebody's own."""

    eye = rs.MountedCamera("eye", Mirror(LENS.K), on="free_camera.body")
    with pytest.raises(rs.errors.InputError, match="Mirror is Python code"):
        Experiment(flying().replacing(eye), rs.IBVS()).to_toml()


def test_beliefs_that_differ_in_the_sign_of_a_zero_are_distinguished():
    scene = flying()
    beliefs = [scene.replacing(rs.Object("dots", marks=[[z, 1, 1]])) for z in (0.0, -0.0)]
    task = rs.Parallel([rs.PBVS(belief=belief) for belief in beliefs])
    told = [each.belief.object().marks[0, 0] for each in again(scene, task).tasks]
    assert np.signbit(told).tolist() == [False, True]


def test_numbers_of_numpy_are_written_like_others():
    large, mark = rs.laws.LargeProjection(np.float32(0.25), np.int64(2)), np.int64(3)
    task = rs.Hybrid(mark=mark, secondary="avoid_limits", projection=large)
    assert again(flying(), task) == task


def test_a_motion_by_a_function_has_no_text():
    scene = flying(motions=[rs.Motion("conveyor", lambda t: [np.sin(t)])])
    with pytest.raises(rs.errors.InputError, match=r"motions\[0\].rates is Python code"):
        Experiment(scene, rs.IBVS()).to_toml()
    run = rs.simulate(scene, rs.IBVS(NEAR), duration=0.1)
    with pytest.raises(rs.errors.InputError, match=r"motions\[0\].rates is Python code"):
        replay(run)


# runs


def holding():
    """Two fixed cameras watch the object that an arm holds; another camera is on a head."""
    arm, head = rs.robots.rhino_xr4(), rs.robots.pan_tilt().at(rs.Pose.at(0, 0.5, 0))
    T = rs.Pose(arm.fk(arm.home))
    part = rs.Object("part", marks=MARKS / 5, on=f"rhino_xr4.{arm.tip}")
    centre = T.position
    eyes = [
        rs.MountedCamera(name, LENS, pose=looking(centre + offset, centre))
        for name, offset in (("left", [0.2, 0.1, 0.5]), ("right", [-0.2, 0.1, 0.5]))
    ]
    turned = rs.Scene([head]).pose(f"pan_tilt.{head.tip}")
    ahead = rs.Object("ahead", marks=MARKS, pose=rs.Pose(turned.matrix) @ rs.Pose.at(0.03, 0, 1))
    eyes.append(rs.MountedCamera("watch", LENS, on=f"pan_tilt.{head.tip}"))
    return rs.Scene([arm, head], [part, ahead], eyes)


def looking(at, target):
    """The pose of a camera that looks at a point."""
    z = (target - at) / np.linalg.norm(target - at)
    x = np.cross(z, [0.0, 0.0, 1.0])
    x = x / np.linalg.norm(x)
    T = np.eye(4)
    T[:3] = np.stack([x, np.cross(z, x), z, at], axis=1)
    return rs.Pose(T)


def driving():
    cart = rs.robots.unicycle()
    eye = rs.MountedCamera("eye", LENS, on="unicycle.camera_mount")
    turned = rs.Scene([cart]).pose("unicycle.camera_mount")
    dots = rs.Object("dots", marks=MARKS, pose=rs.Pose(turned.matrix) @ rs.Pose.at(0, 0, 2))
    return rs.Scene([cart], [dots], [eye])


def servo(**changes):
    return rs.IBVS(**{"goal": NEAR, **JUST_FLYING, **changes})


FLYING = {
    "gain": servo(gain=rs.laws.AdaptiveGain(4, 0.4, 30)),
    "gain of the command": servo(gain=rs.laws.AdaptiveGain(4, 0.4, 30, of="command")),
    "parts": servo(
        features=[rs.features.FeatureBlock("lines", marks=[0, 1, 2, 5], weight=2.0), "log_depth"]
    ),
    "sphere": servo(features=rs.features.Sphere(0.07)),
    "matrix": servo(
        features=[rs.features.FeatureBlock("points", marks=[0, 2, 5])], interaction=np.eye(6)
    ),
    "broyden": servo(interaction="broyden"),
    "broyden start": servo(
        features=[rs.features.FeatureBlock("points", marks=[0, 2, 5])],
        interaction=rs.laws.Broyden(np.eye(6)[::-1]),
    ),
    "filter": servo(depth=rs.laws.DepthFilter(0.8, noise=0.5)),
    "transpose": servo(inverse="transpose", gain=0.5),
    "camera law": servo(law=rs.laws.CameraLaw(0.1), inverse=rs.laws.DampedInverse(0.01)),
    "posture": servo(
        features=[rs.features.FeatureBlock("points", marks=[0])],
        secondary=rs.laws.Posture([0.1] * 6),
        projection="large",
    ),
    "limits": servo(
        secondary=rs.laws.AvoidLimits(margin=0.2),
        smooth_start=2.0,
        limit=rs.laws.SpeedLimit(joint=[0.1, 0.2, 0.1, 0.3, 0.2, 0.2], linear=0.1, angular=0.2),
    ),
    "one limit": servo(limit=rs.laws.SpeedLimit(joint=0.1), gain=5),
    "given": servo(goal=rs.GoalFeatures(0.1 * np.arange(16))),
    "pbvs": rs.PBVS(NEAR, form="camera", **JUST_FLYING),
    "hybrid": rs.Hybrid(NEAR, mark=3, **JUST_FLYING),
    "partitioned": rs.Partitioned(NEAR, segment=(1, 6), advance=0.3, **JUST_FLYING),
    "priorities": rs.Priorities(
        [rs.IBVS(NEAR, features=[rs.features.FeatureBlock("points", marks=[0])]), rs.PBVS(NEAR)],
        joints=["free_camera"],
        secondary=rs.laws.Posture([0.0, 0, -1, 0, 0, 0]),
        smooth_start=1.0,
    ),
    "switch": rs.Switch(rs.PBVS(NEAR, **JUST_FLYING), servo(), rs.tasks.ErrorBelow(0.09)),
    "border": rs.Switch(servo(), rs.PBVS(NEAR), rs.tasks.NearBorder(150, (640, 480)), latch=False),
    **{
        f"ff {how}": servo(feed_forward=how, gain=2)
        for how in ("known", "estimated", rs.laws.EstimatedMotion(0.05))
    },
    "own belief": rs.Switch(
        rs.PBVS(NEAR, belief=flying(motions=[rs.Motion("conveyor", [0.01])]), **JUST_FLYING),
        servo(),
        rs.tasks.ErrorBelow(0.09),
    ),
}


def repeated(scene, task, q0=None, **told):
    task_again = again(scene, task)
    assert task_again == task
    run = rs.simulate(
        scene, task, q0, **{"duration": 0.4, "sensing": rs.Sensing(noise=0.3), "seed": 5, **told}
    )
    assert run.sizes["time"] > 5 and np.isfinite(run["q"].values[:3]).all()
    once_more = replay(run)
    assert once_more.identical(run)
    for name in run.variables:
        assert run[name].values.tobytes() == once_more[name].values.tobytes(), name


@pytest.mark.covering(1)
@pytest.mark.parametrize("hold", [False, True])
@pytest.mark.parametrize("name", FLYING)
@pytest.mark.few(7)
def test_a_run_of_a_flying_camera_is_repeated(name, hold):
    scene = flying(motions=[MOVING] if hold or name.startswith("ff") else [])
    repeated(scene, FLYING[name], hold=hold)


@pytest.mark.parametrize("name", FEATURES)
@pytest.mark.few(4)
def test_a_run_with_any_feature_is_repeated(name):
    if name == "stereo_points":
        repeated(holding(), rs.IBVS(camera=["left", "right"], target="part", features=name))
    else:
        task = servo(features=name)
        if getattr(task.features, "uses_pictures", False):
            near = place_camera(0.02, -0.01, 1.02, 1, -2, 3)
            task = rs.IBVS(GOAL, features=name, depth="goal")
            run = rs.simulate(make_scene(), task, near, duration=0.4, hold=True)
            assert np.isfinite(run["q"].values).all() and replay(run).identical(run)
        else:
            repeated(flying(), task)


def test_a_run_of_two_tasks_side_by_side_is_repeated():
    task = rs.Parallel(
        [
            rs.IBVS(camera="watch", target="ahead", limit=rs.laws.SpeedLimit(joint=[0.1, 0.2])),
            Placing(camera=["left", "right"], target="part", variant="completed"),
        ]
    )
    scene = holding()
    q0 = scene.home + 0.03 * np.array([1, -1, 1, 1, 1, 1, 1])
    repeated(scene, task, q0)
    repeated(scene, task.tasks[1], q0)


def test_runs_that_follow_trajectories_are_repeated():
    scene = holding()
    q, tip = scene.home, scene.pose("rhino_xr4.tool")
    near = rs.Pose.at(0.02, 0, 0.01) @ rs.Pose(tip.matrix)
    arm = rs.FollowJoints({"rhino_xr4.shoulder": q[0] + 0.1}, speed=0.4, acceleration=[1.0])
    repeated(scene, arm)
    points = q[[1, 0]] + 0.05 * np.array([[0, 0], [1, 0], [1, 1]])
    way = Blends(points, speed=[1, 2], acceleration=3, corner=0.01)
    joints = ["rhino_xr4.upper_arm", "rhino_xr4.shoulder"]
    repeated(scene, rs.FollowJoints(trajectory=way, joints=joints))
    path = rs.FollowPath(near, frame="rhino_xr4.tool", mask="position", duration=0.3)
    repeated(scene, path)
    watching = rs.IBVS(camera="watch", target="ahead")
    q0 = q + 0.03 * np.array([0, 0, 0, 0, 0, 1, 1])
    repeated(scene, rs.Parallel([path, watching]), q0)


def test_a_trajectory_of_somebody_has_no_text():
    class Wave:
        duration = 1.0

        def at(self, t):
            return np.eye(4) if self.frame else np.zeros(1)

    for frame, make in ((False, rs.FollowJoints), (True, rs.FollowPath)):
        Wave.frame = frame
        name = {"path": Wave()} if frame else {"trajectory": Wave(), "joints": "conveyor"}
        task = make(**name, **({"frame": "eye"} if frame else {}))
        with pytest.raises(rs.errors.InputError, match="Wave is Python code"):
            Experiment(any_scene(), task).to_toml()


def test_a_run_of_a_cart_is_repeated():
    repeated(driving(), Docking(turn=2.5, h=1.5, gain=0.7), [-0.3, 0.1, -0.05])
