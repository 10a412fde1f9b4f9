"""Scene -> text -> scene, run -> text -> run: the same bits."""

import dataclasses

import numpy as np
import pytest
import xarray as xr
from draws import try_samples
from hypothesis import strategies as st

import robsim as rs
from robsim import examples
from robsim.run.experiment import Experiment, load_scenario
from robsim.run.replay import replay


def bits(value):
    """All that a value is equal by, comparable bit for bit: -0.0 is not 0.0."""
    if isinstance(value, rs.Pose):
        return value.matrix.tobytes()  # names of frames are notes, not numbers
    if isinstance(value, np.ndarray):
        return value.shape, value.tobytes()
    if isinstance(value, float):
        return value.hex()
    if isinstance(value, tuple | list):
        return [bits(item) for item in value]
    if dataclasses.is_dataclass(value):
        own = [f.name for f in dataclasses.fields(value) if f.init and f.compare]
        return type(value).__name__, {name: bits(getattr(value, name)) for name in own}
    return value


def any_pose(rng, exact=False):
    """Poses as users make them, with zeros of both signs among their numbers."""
    choice = rng.integers(4)
    if choice == 0:
        return rs.Pose.at(*rng.normal(size=3), rpy=rng.normal(size=3))
    if choice == 1:
        return rs.Pose.at(0.1, -0.0, 1e-17, rotvec=(0, 0, np.pi))
    if choice == 2:
        return rs.Pose.at(rpy=(0, 0, np.pi / 2)).inv() @ rs.Pose.at(0, 1 / 3, 0)
    return rs.Pose.at()


def any_shapes(rng):
    sizes = rng.uniform(0.01, 1, 8)
    return (
        rs.Block(*sizes[:3], color="tab:red").at(any_pose(rng)),
        rs.Wheel(*sizes[3:5], n=5 + int(rng.integers(9)), color="#00ff00", pose=any_pose(rng)),
        rs.CameraBody(*sizes[5:], color="k", mass=sizes[0]).at(any_pose(rng)),
        rs.shapes.Ball(sizes[6], n=7, density=1e3 * sizes[1]).at(any_pose(rng)),
        rs.shapes.Capsule(*sizes[2:4], n=9, color="w", pose=any_pose(rng)),
        rs.shapes.TaperedCylinder(*sizes[1:4], mass=sizes[0]).at(any_pose(rng)),
        rs.shapes.Mesh("package://a/b c.stl", (1, -sizes[2], 0.001), "#123456", pose=any_pose(rng)),
    )


def any_inertia(rng):
    """Of three bars that cross somewhere."""
    bars = [rs.Block(*rng.uniform(0.01, 1, 3), mass=rng.uniform(0.1, 9)) for _ in range(3)]
    solid = rs.joints.Link("bars", shapes=[bar.at(any_pose(rng)) for bar in bars]).inertial
    ring = rs.shapes.Inertia(0.0, any_pose(rng).position, np.diag([0, 0.35, 0]))
    needle = rs.shapes.Inertia(1.0, any_pose(rng).position, np.diag([0, 0.35, 0]), strict=False)
    return [solid, ring, needle][rng.integers(3)]


def any_arm(rng, name):
    """An arm on a rail from a DH table; on it a fixed plate, and things that move about on that."""
    rows = rng.normal(size=(3, 4))
    home = rng.uniform(-0.5, 0.5, 3)
    limits = np.stack([home - rng.uniform(0.1, 1, 3), home + 1], axis=1)
    convention = ["standard", "modified"][rng.integers(2)]
    shapes = [any_shapes(rng)[: rng.integers(4)] for _ in range(4)]
    arm = rs.Robot.from_dh(rows, convention, "PRR", home, limits, name, shapes=shapes)
    plate = rs.joints.Link("plate", "link2", rs.joints.Joint("fixed", any_pose(rng), any_pose(rng)))
    held = rs.joints.Link(
        "held", "plate", rs.joints.Joint("floating", tail=any_pose(rng)), any_shapes(rng)
    )
    held = dataclasses.replace(held, inertia=any_inertia(rng))
    deck = rs.joints.Link("deck", "plate", rs.joints.Joint("planar", any_pose(rng), any_pose(rng)))
    rover = rs.joints.Link(
        "rover", "deck", rs.joints.Joint("unicycle", any_pose(rng)), any_shapes(rng)
    )
    home = [*home, *any_pose(rng).q, *rng.normal(size=6)]
    return rs.Robot(name, (*arm.links, plate, held, deck, rover), home, base=any_pose(rng))


def any_camera(rng, name, on):
    f, c = rng.uniform(300, 900, 2), rng.uniform(100, 400, 2)
    K = [[f[0], rng.normal(), c[0]], [0, f[1], c[1]], [0, 0, 1]]
    size = [None, (640, 480)][rng.integers(2)]
    body = [None, any_shapes(rng)[2]][rng.integers(2)]
    lens = rng.normal(size=rng.choice([0, 4, 5, 8])) / 100
    model = "fisheye" if len(lens) == 4 and lens[0] > 0 else "perspective"
    camera = rs.Camera(K, size, body=body, distortion=lens, lens=model)
    return rs.MountedCamera(name, camera, on, any_pose(rng))


def any_scene(rng):
    """Two robots, one on the other, objects with and without marks, two cameras, a display."""
    arm = any_arm(rng, "arm")
    fly = rs.robots.free_camera().named("fly").at(any_pose(rng), on="arm.plate")
    objects = [
        rs.Object("box", any_shapes(rng)[:2], pose=any_pose(rng), on="fly.body"),
        rs.Object("dots", marks=rng.normal(size=(5, 3)), pose=any_pose(rng)),
        rs.Object("bare"),
        rs.Object("drawn", any_shapes(rng), marks=np.empty((0, 3)), on="bare"),
    ]
    cameras = [any_camera(rng, "eye", "arm.held"), any_camera(rng, "wall", "world")]
    return rs.Scene([arm, fly], objects, cameras, display=any_pose(rng))


def any_task(rng, scene):
    goals = [rs.GoalPose(any_pose(rng)), scene.home]
    laws = ["joint", rs.laws.CameraLaw(rng.uniform(0.01, 1))]
    inverses = [
        rs.laws.PseudoInverse(rng.uniform(0, 1e-3)),
        rs.laws.DampedInverse(rng.uniform(0.001, 1)),
    ]
    beliefs = [None, any_scene(rng), scene.replacing(any_camera(rng, "eye", "arm.link3"))]
    return rs.IBVS(
        goals[rng.integers(2)],
        camera="eye",
        target="dots",
        features=[rs.features.Points(), rs.features.PixelPoints()][rng.integers(2)],
        interaction=["current", "desired", "mean"][rng.integers(3)],
        depth=["true", "goal", rng.uniform(0.1, 1)][rng.integers(3)],
        depth_scale=rng.uniform(0.5, 2),
        law=laws[rng.integers(2)],
        gain=rng.uniform(0.1, 5),
        inverse=inverses[rng.integers(2)],
        tolerance=rng.uniform(1e-6, 1e-3),
        belief=beliefs[rng.integers(3)],
    )


def any_sensing(rng):
    hidden = rs.imperfections.Occlusion(
        [0, 2], rng.uniform(0.1, 1), target=[None, "plate"][rng.integers(2)]
    )
    while_ = rs.imperfections.Occlusion(1, 0.5, 0.5 + rng.uniform(0.1, 1), camera="eye")
    numbers = rng.uniform(0.01, 0.9, 7)
    full = rs.Sensing(*numbers[:4], [hidden, while_], *numbers[4:])
    return [rs.Sensing(), rs.Sensing(noise=numbers[0]), full][rng.integers(3)]


def any_actuation(rng, scene):
    each = rs.Actuation(
        rng.uniform(),
        rng.uniform(0.1, 1, scene.nv),
        rng.uniform(0.1, 1, scene.nv),
        rng.uniform(0, 1, scene.nq),
    )
    return [rs.Actuation(), rs.Actuation(*rng.uniform(0.1, 1, 4)), each][rng.integers(3)]


def any_safety(rng, scene):
    """Limits for all joints or for each, in part or none at all."""
    frames = [f"{robot.name}.{link.name}" for robot in scene.robots for link in robot.links]
    moved = [frame for frame in frames if scene.tree.flag_moves(frame).any()]
    fence = None
    if moved:
        fence = rs.control.Fence(moved[0], rng.uniform(-2, -1, 3), rng.uniform(1, 2, 3))
    dog = rs.control.Watchdog(rng.uniform(0.1, 1), ["hold", "stop"][rng.integers(2)])
    speeds, rates = rng.uniform(0.1, 1, (2, scene.nv))
    several = rs.Safety(speeds, rates, rng.uniform(0, 1e-3, scene.nq), fence, hold_to_run=True)
    same = rs.Safety(*rng.uniform(0.1, 1, 2), 1e-3, None, dog, rng.uniform(0.1, 1))
    return [None, same, several][rng.integers(3)]


def any_connection(rng, scene):
    """Topics and names of messages, or none."""
    joints, frames = scene.coordinate_names, list(scene.tree.where)
    named = rs.control.RosConnection(
        marks="/eyes/CAMERA",
        command_type="sensor_msgs/msg/JointState",
        names={name: f'"{i}" = \\' for i, name in enumerate(joints[:3])},
        ids={each.name: ["a.0", "b"] for each in scene.objects[:2]},
        frames={frames[-1]: "map"},
        order=["b", "a"],
        patience=rng.uniform(0.1, 1),
    )
    return [None, rs.control.RosConnection(), named][rng.integers(3)]


@pytest.mark.parametrize(
    "seeds", [range(3), pytest.param(range(3, 18), marks=pytest.mark.full)], ids=str
)
def test_any_scenario_comes_back_from_its_text_bit_for_bit(seeds):
    for seed in seeds:
        any_scenario_comes_back(np.random.default_rng(seed))


def any_scenario_comes_back(rng):
    scene = any_scene(rng)
    dt, seed = rng.uniform(0.001, 0.1), int(rng.integers(2**63))
    options = {
        "dt": dt,
        "duration": rng.uniform(1, 9),
        "seed": seed,
        "sensing": any_sensing(rng),
        "actuation": any_actuation(rng, scene),
        "safety": any_safety(rng, scene),
        "record": 7,
        "ros2": any_connection(rng, scene),
    }
    q0 = [None, scene.home][rng.integers(2)]
    scenario = Experiment(scene, any_task(rng, scene), q0, **options, title='"quoted" \\ 50 %')
    text = scenario.to_toml()
    again = Experiment.from_text(text)
    assert bits(again.scene) == bits(scene)
    assert bits(again.task) == bits(scenario.task)
    assert bits(again.start) == bits(q0)
    own = {**options, "endings": (), "hold": False, "first_run": 0, "title": scenario.title}
    assert again.settings == scenario.settings == own
    assert again.to_toml() == text


def any_curve(rng):
    a, b, c = rng.uniform(0.5, 2, 3)
    return [
        rs.shapes.curves.Line(a),
        rs.shapes.curves.Arc(a, [-b, b][rng.integers(2)]),
        rs.shapes.curves.Polyline(
            [(0, -0.0), (a, 0), (a, b), (a + 1, b + c)], 0.1 * rng.uniform(0.1, 1)
        ),
        rs.shapes.curves.Catenary((-a, b), (1 / 3, c), 1.1 * np.hypot(1 / 3 + a, b - c)),
    ][rng.integers(4)]


def any_joint(rng, kind, **parts):
    """A joint of one coordinate with all that it may have."""
    if rng.integers(2):
        parts |= {"speed": rng.uniform(0.1, 2), "effort": rng.uniform(1, 9)}
        parts |= {part: rng.uniform(0.01, 1) for part in ("armature", "damping", "friction")}
    if kind == "prismatic" and rng.integers(2):
        parts["limits"] = (-rng.uniform(0.1, 1), rng.uniform(0.1, 1))
    return rs.joints.Joint(kind, any_pose(rng), any_pose(rng), **parts)


def any_vehicle(rng):
    """A car that carries a gripper, behind it a crawler on a rail: all keys of joints."""
    axle = rs.Pose.at(0.5, rng.normal(), 0.1)
    across = rs.Pose.at(rpy=([-1, 1][rng.integers(2)] * np.pi / 2, 0, 0))
    steering = rs.joints.Steering(*rng.uniform(0.1, 1, 3))
    rail, wheel = any_curve(rng), rs.joints.Rolling(rng.uniform(0.1, 1))
    beside = rng.uniform(-0.9, 0.9) / max(1.0, *np.abs(rail.bends))  # a wheel that fits
    chord = rs.joints.Chord("way", 0.02, beside, rng.uniform(0.01, 0.02), gives="angle")
    tied = rs.joints.Mimic("grip", rng.normal(), rng.normal())
    steers = rs.joints.Ackermann("drive.steering")
    links = [
        rs.joints.Link("floor"),
        rs.joints.Link(
            "car", "floor", rs.joints.Joint("car", any_pose(rng), steering=steering, name="drive")
        ),
        rs.joints.Link("pivot", "car", rs.joints.Joint("revolute", axle, follows=steers)),
        rs.joints.Link(
            "wheel", "pivot", rs.joints.Joint("revolute", across, follows=wheel, name="turn")
        ),
        rs.joints.Link("finger", "car", any_joint(rng, "prismatic", name="grip"), any_shapes(rng)),
        rs.joints.Link("other", "car", any_joint(rng, "revolute", follows=tied)),
        rs.joints.Link("rear", "floor", any_joint(rng, "rail", curve=rail, name="way")),
        rs.joints.Link("body", "rear", any_joint(rng, "revolute", follows=chord)),
    ]
    return rs.Robot("train", links)


@try_samples(10, 50, seed=st.integers(0, 2**32 - 1))
def test_any_vehicle_gripper_and_rail_comes_back_bit_for_bit(seed):
    rng = np.random.default_rng(seed)
    robot = any_vehicle(rng)
    eye = rs.MountedCamera("eye", rs.Camera(np.eye(3)), "train.car")
    scene = rs.Scene([robot], [rs.Object("dot", marks=[[0, 0, 1]])], [eye])
    text = Experiment(scene, rs.IBVS()).to_toml()
    again = Experiment.from_text(text)
    assert bits(again.scene) == bits(scene)
    assert again.to_toml() == text


def test_an_arm_with_a_tool_comes_back_bit_for_bit():
    tool = rs.robots.rhino_gripper()
    robot = rs.robots.rhino_xr4().with_tool(tool, rs.Pose.at(z=-0.1083), bare=True)
    robot = robot.with_tool(tool.named("second"), any_pose(np.random.default_rng(1)))
    eye = rs.MountedCamera("eye", rs.Camera(np.eye(3)), "rhino_xr4.tip")
    scene = rs.Scene([robot], [rs.Object("dot", marks=[[0, 0, 1]])], [eye])
    held = scene.attached("dot", "rhino_xr4.second_tip", scene.home + 0.01)
    for each in (scene, held):
        assert bits(Experiment.from_text(Experiment(each, rs.IBVS()).to_toml()).scene) == bits(each)


@pytest.mark.parametrize("name", rs.robots.names())
def test_the_robots_of_the_library_come_back(name):
    robot = rs.robots.load(name)
    eye = rs.MountedCamera("eye", rs.Camera(np.eye(3)))
    scene = rs.Scene([robot], [rs.Object("dot", marks=[[0, 0, 1]])], [eye])
    again = Experiment.from_text(Experiment(scene, rs.IBVS()).to_toml())
    assert bits(again.scene) == bits(scene)


def test_a_belief_that_lacks_a_pose_or_a_thing_of_the_truth_comes_back():
    eye = rs.MountedCamera("eye", rs.Camera(np.eye(3)), "free_camera.body", rs.Pose.at(1, 0, 0))
    dots = rs.Object("dots", marks=np.eye(3))
    robot = rs.robots.free_camera()
    truth = rs.Scene([robot], [dots, rs.Object("wall")], [eye])
    belief = rs.Scene(
        [robot.named("model")],
        [dots, rs.Object("door")],
        [rs.MountedCamera("eye", eye.camera, "model.body")],
    )
    again = Experiment.from_text(Experiment(truth, rs.IBVS(belief=belief)).to_toml())
    assert bits(again.task.belief) == bits(belief)


# runs


def identical(a, b):
    """The same variables, bit for bit, and the same notes."""
    xr.testing.assert_identical(a, b)
    for name in a.variables:
        assert a[name].values.tobytes() == b[name].values.tobytes(), name


@pytest.fixture
def starts(puma_goal):
    return puma_goal + np.random.default_rng(2).uniform(-0.05, 0.05, (5, 6))


SETTINGS = {"dt": 0.05, "duration": 1.0, "sensing": rs.Sensing(noise=0.4), "seed": 2**63 + 5}


@pytest.fixture
def task(puma_scene, puma_goal):
    eye = puma_scene.camera()
    askew = dataclasses.replace(eye, pose=rs.Pose.at(0, 0.01, 0, rpy=(0, 0, 0.1)))
    return rs.IBVS(puma_goal, gain=2.0, belief=puma_scene.replacing(askew), inverse="damped")


@pytest.mark.parametrize("record", ["all", 3, "summary"])
def test_a_batch_is_repeated_from_its_own_text(puma_scene, task, starts, record):
    run = rs.simulate(puma_scene, task, starts, first_run=4, record=record, **SETTINGS)
    identical(replay(run), run)


def test_a_single_run_is_repeated_from_its_own_text(puma_scene, task, starts):
    run = rs.simulate(puma_scene, task, starts[0], **SETTINGS)
    identical(replay(run), run)
    text = run.attrs["scenario"]
    assert Experiment.from_text(text).run().attrs["scenario"] == text


def test_a_run_that_was_saved_is_repeated(puma_scene, task, starts, tmp_path):
    run = rs.simulate(puma_scene, task, starts, record=np.int64(2), **SETTINGS)
    again = replay(rs.open_run(rs.save_run(run, tmp_path / "run.nc")))
    for name in run.variables:
        assert run[name].values.tobytes() == again[name].values.tobytes(), name


def test_rows_of_a_batch_are_repeated_with_their_own_noise(puma_scene, task, starts):
    run = rs.simulate(puma_scene, task, starts, **SETTINGS)
    for rows in (3, slice(2, 4)):
        part = run.isel(run=rows)
        again = replay(part)
        for name in part.variables:
            assert part[name].values.tobytes() == again[name].values.tobytes(), name
    with pytest.raises(rs.errors.InputError, match=r"runs \[0, 2\] are not consecutive"):
        replay(run.isel(run=[0, 2]))


def test_steps_are_the_same_whatever_the_rounding_of_duration(puma_scene, puma_goal, starts):
    for dt, steps in [(0.1, 3), (0.07, 23), (1 / 3, 7), (0.001, 4095)]:
        task = rs.IBVS(puma_goal, tolerance=1e-300)
        run = rs.simulate(puma_scene, task, starts[0], dt=dt, duration=steps * dt, record="summary")
        identical(replay(run), run)


class Mine:
    def command(self, state):
        return -state.gain * np.zeros(state.jacobian.shape[::2])


def test_a_run_of_python_code_reports_that_it_cannot_be_repeated(puma_scene, puma_goal, starts):
    run = rs.simulate(puma_scene, rs.IBVS(puma_goal, law=Mine()), starts[0], duration=0.1)
    with pytest.raises(rs.errors.InputError, match="Mine is Python code"):
        replay(run)


def test_a_file_that_is_no_run_is_reported(puma_scene, puma_goal, starts):
    with pytest.raises(rs.errors.InputError, match=r"attrs\['scenario'\]"):
        replay(xr.Dataset())
    run = rs.simulate(puma_scene, rs.IBVS(puma_goal), starts[0], duration=0.1)
    with pytest.raises(rs.errors.InputError, match="it has no 'q0'"):
        replay(run.drop_vars("q0"))


class Brick(rs.Block):
    """Somebody's own shape."""


@pytest.mark.parametrize(
    "shape,reason",
    [(Brick(1, 1, 1), "Brick is Python code"), (rs.Block(1, 1, 1, (1, 0, 0)), "color")],
)
def test_a_shape_that_a_file_cannot_hold_does_not_stop_a_run(
    puma_scene, puma_goal, starts, shape, reason
):
    scene = dataclasses.replace(
        puma_scene, objects=[*puma_scene.objects, rs.Object("own", shape, marks=np.empty((0, 3)))]
    )
    run = rs.simulate(scene, rs.IBVS(puma_goal), starts[0], duration=0.1)
    assert run.attrs["scenario"] == "" and reason in run.attrs["no_scenario"]
    with pytest.raises(rs.errors.InputError, match=reason):
        replay(run)


def test_numbers_of_numpy_are_written_like_others(puma_scene, puma_goal):
    wheel = rs.Wheel(np.float32(0.5), np.float64(0.1), n=np.int64(7))
    scene = dataclasses.replace(puma_scene, objects=[rs.Object("wheel", wheel)])
    sensing, actuation = rs.Sensing(np.float32(0.5)), rs.Actuation(encoder=np.float32(0.5))
    options = {
        "dt": np.float32(0.5),
        "duration": np.float64(1),
        "seed": np.int64(3),
        "sensing": sensing,
        "actuation": actuation,
        "record": np.int64(2),
    }
    inverse = rs.laws.PseudoInverse(np.float32(0.25))
    again = Experiment.from_text(
        Experiment(scene, rs.IBVS(puma_goal, inverse=inverse), **options).to_toml()
    )
    assert again.scene.object("wheel").shapes == (rs.Wheel(0.5, 0.1, 7),)
    assert (again.dt, again.duration, again.seed, again.record) == (0.5, 1.0, 3, 2)
    assert (again.sensing, again.actuation) == (rs.Sensing(0.5), rs.Actuation(encoder=0.5))
    assert again.task.inverse == rs.laws.PseudoInverse(0.25)


def test_code_in_a_scenario_has_no_text(puma_scene, puma_goal):
    with pytest.raises(rs.errors.InputError, match="Mine is Python code"):
        Experiment(puma_scene, rs.IBVS(puma_goal, law=Mine())).to_toml()


# scenarios and their runs


@pytest.fixture
def example():
    return load_scenario(examples.path("chapter_6_1"), {"run.duration": "1 s"})


def test_a_run_of_a_scenario_keeps_its_text_and_is_repeated(example):
    run = example.run()
    assert run.attrs["scenario"] == example.to_toml(complete=True)
    identical(replay(run), run)
    plain = rs.simulate(example.scene, example.task, example.start, dt=0.04, duration=1.0)
    for name in run.variables:
        assert run[name].values.tobytes() == plain[name].values.tobytes(), name


@pytest.mark.parametrize("change", [{"seed": 3}, {"sensing": rs.Sensing(noise=1.0)}, {"dt": 0.02}])
def test_the_text_of_a_run_with_changes_contains_the_changes(example, change):
    run = example.run(**change)
    assert run.attrs["scenario"] != example.to_toml(complete=True)
    identical(replay(run), run)


def test_a_run_of_a_changed_scenario_does_not_keep_the_old_text(example):
    other = dataclasses.replace(example, task=dataclasses.replace(example.task, gain=0.1))
    run = other.run(threads=1)
    assert "gain = 0.1" in run.attrs["scenario"]
    identical(replay(run), run)


def test_an_interrupted_run_keeps_the_text(example):
    def stop(share):
        raise KeyboardInterrupt

    with pytest.raises(rs.errors.Interrupted) as caught:
        example.run(stop)
    assert caught.value.run.attrs["scenario"] == example.to_toml(complete=True)


FEW = ("visp_tutorial", "inspection_b", "wrong_calibration")
EACH = [pytest.param(x, marks=[pytest.mark.full] * (x not in FEW)) for x in examples.names()]


@pytest.mark.parametrize("name", EACH)
def test_the_examples_and_their_full_texts_give_the_same_experiment(name):
    scenario = load_scenario(examples.path(name))
    scenario.check()
    again = Experiment.from_text(scenario.to_toml())
    assert bits(again.scene) == bits(scenario.scene)
    assert again.to_toml() == scenario.to_toml()
