"""Numbers that differ from run to run: each run equals its own experiment, bit for bit."""

import numpy as np
import pytest

import robsim as rs
from robsim import examples
from robsim.servo.tasks.task import ServoTask

RUNS = 3
OWN_LAW = ("unicycle_docking", "chapter_6_2")
SERVOED = [
    name
    for name in examples.names()
    if isinstance(rs.load_scenario(examples.path(name)).task, ServoTask) and name not in OWN_LAW
]
FEW = (  # of each kind of robot, task and imperfection one
    "adaptive_gain", "chapter_6_1", "eye_to_hand", "holonomic", "joint_limits", "marks_come_and_go",
    "noise_floor", "pan_tilt_tracking", "pbvs_loses_target", "stereo_in_hand", "wrong_dh",
)  # fmt: skip
EACH = [pytest.param(name, marks=[pytest.mark.full] * (name not in FEW)) for name in SERVOED]
COMPARED = [
    "q",
    "s",
    "qd",
    "error",
    "pixels",
    "camera_pose",
    "camera_velocity",
    "s_goal",
    "pixels_goal",
    "goal_pose",
    "outcome",
    "distance_to_goal",
    "angle_to_goal",
    "path_length",
    "end_time",
]


def spread(rng, value, size=1e-3):
    value = np.asarray(value, dtype=float)
    room = np.maximum(np.abs(value), 0.1)
    return value + size * room * rng.uniform(-1, 1, (RUNS, *value.shape))


def numbers_of(scene, prefix, rng, links):
    """Return numbers for cameras, objects and robots of a scene, by name."""
    made = {}
    for eye in scene.cameras:
        (fx, skew, cx), (_, fy, cy), _ = eye.camera.K
        lens = {"focal": [fx, fy], "center": [cx, cy], "skew": skew, "distortion": [0.01, 0, 0, 0]}
        pose = {"position": eye.pose.position, "rotvec": eye.pose.rotvec}
        made |= {f"{prefix}cameras.{eye.name}.{k}": x for k, x in {**lens, **pose}.items()}
    for thing in scene.objects:
        if len(thing.marks) and thing.target is None:  # marks would replace a printed target
            made[f"{prefix}objects.{thing.name}.marks"] = thing.marks
            made[f"{prefix}objects.{thing.name}.position"] = thing.pose.position
            made[f"{prefix}objects.{thing.name}.rotvec"] = thing.pose.rotvec
    robot = scene.robots[0]
    made[f"{prefix}robots.{robot.name}.position"] = robot.base.position
    made |= {f"{prefix}robots.{robot.name}.links.{name}": x for name, x in links.items()}
    return {name: spread(rng, x) for name, x in made.items()}


def everything(experiment, rng, links):
    belief = experiment.task.belief or experiment.scene
    other = {"task.gain": 1.0, "sensing.noise": 0.2}
    drive = experiment.actuation.drive
    if drive is None:
        other["actuation.lag"] = 0.02
    else:
        other["actuation.drive.model.mass"] = 1.0
    if experiment.task.needs_depth:
        other["task.depth_scale"] = 1.0
    if isinstance(experiment.task.gain, float):
        other["task.gain"] = experiment.task.gain
    return {
        **numbers_of(experiment.scene, "", rng, links),
        **numbers_of(belief, "belief.", rng, links),
        **{name: spread(rng, x) for name, x in other.items()},
    }


def check_same(experiment):
    """Check that the runs of a varied experiment equal the single runs, bit for bit."""
    runs = experiment.run()
    for i in range(RUNS):
        own = experiment.of_run(i).run()
        assert own.sizes.get("run", 1) == 1
        for name in COMPARED:
            if name not in own:
                continue
            mine = runs[name].isel(run=i) if "run" in runs[name].dims else runs[name]
            if "time" in mine.dims:
                mine = mine.isel(time=slice(own.sizes["time"]))
            np.testing.assert_array_equal(mine.values, own[name].values, err_msg=name)
    return runs


@pytest.mark.filterwarnings("ignore::robsim.errors.RankWarning")
@pytest.mark.parametrize("name", EACH)
@pytest.mark.few(2)
def test_each_run_has_the_bits_of_its_own_experiment(name):
    experiment = rs.load_scenario(examples.path(name))
    experiment = experiment.with_(duration=min(experiment.duration, 40 * experiment.dt))
    numbers = everything(experiment, np.random.default_rng(5), {})
    runs = check_same(experiment.vary(numbers))
    assert len(np.unique(runs.q_end.values, axis=0)) == RUNS


@pytest.mark.parametrize(
    ("name", "link"), [("eye_in_hand", "link3"), ("wrong_dh", "forearm"), ("stereo_in_hand", "?")]
)
def test_the_constants_of_a_link_differ_from_run_to_run(name, link):
    """Modified rows of a Panda, standard ones of a Puma, and of the arm of a stereo pair."""
    experiment = rs.load_scenario(examples.path(name)).with_(duration=1.0)
    robot = experiment.scene.robots[0]
    link = robot.links[3].name if link == "?" else link
    links = {f"{link}.dh.{key}": 0.1 for key in ("theta", "d", "a", "alpha")}
    numbers = everything(experiment, np.random.default_rng(2), links)
    for key in ("theta", "d", "a", "alpha"):
        first = numbers[f"robots.{robot.name}.links.{link}.dh.{key}"]
        assert len(np.unique(first)) == RUNS
    numbers = {n: x for n, x in numbers.items() if ".links." in n}
    quiet = {n: x for n, x in numbers.items() if n.startswith("belief.")}
    check_same(experiment.vary(quiet))


@pytest.mark.filterwarnings("ignore::robsim.errors.RankWarning")
def test_the_law_of_the_partitioned_scheme_agrees_with_any_scene():
    experiment = rs.load_scenario(examples.path("schemes_compared"), ["task.kind=partitioned"])
    numbers = everything(experiment.with_(duration=2.0), np.random.default_rng(4), {})
    check_same(experiment.with_(duration=2.0).vary(numbers))


def test_the_numbers_of_a_task_of_ones_own_class_may_differ():
    class Mine(rs.IBVS):
        pass

    experiment = rs.load_scenario(examples.path("schemes_compared")).with_(duration=2.0)
    numbers = {"task.gain": [1.0, 2.0], "task.depth_scale": [0.8, 1.2]}
    numbers["belief.cameras.camera.focal"] = [390.0, 410.0]
    goal = experiment.task.goal
    own, other = (experiment.with_(task=kind(goal)).vary(numbers).run() for kind in (Mine, rs.IBVS))
    np.testing.assert_array_equal(own.q.values, other.q.values)
    one = experiment.with_(task=Mine(goal)).at("task.gain", 3.0)
    assert type(one.task) is Mine and one.task.gain == 3.0
    with pytest.raises(rs.errors.InputError, match="gain"):
        one.at("task.gain", -1.0)


FOCAL = "belief.cameras.camera.focal"


@pytest.fixture
def wrong():
    """A computed goal seen with three focal lengths."""
    experiment = rs.load_scenario(examples.path("calibration_errors")).with_(duration=2.0)
    return experiment.vary({FOCAL: [540.0, 550.0, 560.0]})


@pytest.mark.parametrize(("threads", "chunk"), [(1, 1), (2, 2), (2, 256)])
def test_chunks_and_threads_change_no_bit(wrong, threads, chunk):
    whole, cut = wrong.run(threads=1), wrong.run(threads=threads, chunk=chunk)
    assert whole.equals(cut)


def test_each_run_may_have_a_start_of_its_own(wrong):
    starts = np.stack([wrong.start, wrong.start, wrong.start])
    starts[:, 0] += [0.0, 0.01, 0.02]
    runs = wrong.with_(start=starts).run()
    own = wrong.with_(start=starts).of_run(2)
    np.testing.assert_array_equal(own.start, starts[2])
    np.testing.assert_array_equal(runs.q_end.values[2], own.run().q_end.values)


def test_the_run_lists_the_varied_numbers_and_can_be_repeated(wrong, tmp_path):
    rs.save_run(wrong.run(), tmp_path / "runs.nc")
    runs = rs.open_run(tmp_path / "runs.nc")
    np.testing.assert_array_equal(runs[FOCAL].values, [540.0, 550.0, 560.0])
    again = rs.Experiment.of(runs)
    np.testing.assert_array_equal(again.varied[FOCAL], wrong.varied[FOCAL])
    np.testing.assert_array_equal(again.run().q.values, runs.q.values)
    one = rs.Experiment.of(runs.isel(run=2))
    assert not one.varied and one.task.belief.camera().camera.K[0, 0] == 560.0
    np.testing.assert_array_equal(one.run().q_end.values, runs.q_end.values[2])
    assert rs.explain(runs.isel(run=2), trials=False).outcome == rs.Outcome(int(runs.outcome[2]))


def test_a_change_by_name_replaces_a_varied_number(wrong):
    assert not wrong.at(FOCAL, 500.0).varied
    assert wrong.at("task.gain", 2.0).varied.keys() == {FOCAL}
    assert wrong.vary({"task.gain": [1, 2, 3]}).varied.keys() == {FOCAL, "task.gain"}
    assert wrong != wrong.vary({FOCAL: [540.0, 550.0, 561.0]})
    assert wrong == wrong.vary({FOCAL: [540.0, 550.0, 560.0]})


def test_a_belief_follows_the_true_value_unless_it_has_its_own():
    """As in `at`: this belief has a focal length of its own, and the position of the truth."""
    experiment = rs.load_scenario(examples.path("calibration_errors"))
    names = {"cameras.camera.position": np.zeros((2, 3)), "cameras.camera.focal": [500.0, 510.0]}
    names["cameras.camera.position"][1] = 0.01
    controller = experiment.vary(names).loop().controller
    (believed,), (true,) = controller.bound_features.sights, controller.sights
    np.testing.assert_array_equal(true.eye.camera.K[0, 0], [500.0, 510.0])
    assert believed.eye.camera.K[0, 0] == 550.0
    np.testing.assert_array_equal(believed.eye.pose.position, names["cameras.camera.position"])


BAD = {
    "no mapping": ([1.0, 2.0], "expected {name: numbers}"),
    "nothing": ({}, "expected {name: numbers}"),
    "a name that cannot differ": ({"run.dt": [0.01, 0.02]}, "cannot differ from run to run"),
    "a feature": ({"task.features": [1, 2]}, "cannot differ from run to run"),
    "no such camera": ({"cameras.eye.focal": [500.0]}, "eye"),
    "one number": ({FOCAL: 500.0}, r"\(runs,\) or \(runs, 2\), got \(\)"),
    "three focal lengths": ({FOCAL: np.ones((2, 3))}, r"\(runs,\) or \(runs, 2\)"),
    "no run": ({FOCAL: []}, r"expected shape \(runs,\)"),
    "not finite": ({FOCAL: [500.0, np.nan]}, "finite"),
    "below zero": ({FOCAL: [500.0, -1.0]}, "greater than 0"),
    "text": ({FOCAL: ["500", "510"]}, "expected a number"),
    "unequal numbers": ({FOCAL: [5e2] * 3, "task.gain": [1, 2]}, "3 of .*focal, 2 of task.gain"),
    "a joint without lag": ({"actuation.lag": [0.0, 0.1]}, "each must be above 0"),
    "no rotation": ({"cameras.camera.rotation": np.ones((2, 3, 3))}, "rotation"),
    "a mark less": ({"belief.objects.square.marks": np.zeros((2, 3, 3))}, "marks"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_number_that_cannot_vary_is_refused_before_anything_runs(case):
    numbers, message = BAD[case]
    with pytest.raises(rs.RobSimError, match=message):
        rs.load_scenario(examples.path("calibration_errors")).vary(numbers).loop()


def test_several_runs_have_no_text_no_steps_and_no_controller(wrong):
    for ask in (wrong.to_toml, lambda: wrong.text, wrong.steps, lambda: rs.Controller(wrong)):
        with pytest.raises(rs.errors.InputError, match="of_run"):
            ask()
    with pytest.raises(rs.errors.InputError, match="3 numbers for 2 starts"):
        wrong.with_(start=np.stack([wrong.start] * 2))
    with pytest.raises(rs.errors.InputError, match="run must be below 3"):
        wrong.of_run(3)


def test_tasks_of_several_tasks_and_bound_laws_are_refused():
    for name in (*OWN_LAW, "mobile_arm"):
        with pytest.raises(rs.errors.InputError, match="for one servo task"):
            rs.load_scenario(examples.path(name)).vary({"sensing.noise": [0.1, 0.2]})


class Shifted:
    """Images that shift by and by, and shake."""

    def seen(self, pixels, exposure):
        return pixels + 2.0 * exposure.time + 0.1 * exposure.normal(pixels.shape[1])


IMPERFECT = {
    "sensing.noise": [0.0, 0.3, 1.0],
    "sensing.latency": [0.0, 0.03, 0.1],
    "sensing.quantisation": [0.0, 0.25, 1.0],
    "sensing.outliers": [0.0, 0.1, 0.3],
    "sensing.dropped": [0.0, 0.2, 0.6],
    "actuation.lag": [0.02, 0.05, 0.2],
    "actuation.velocity": [0.02, 0.05, 10.0],
    "actuation.acceleration": [0.05, 0.2, 10.0],
    "actuation.encoder": [0.0, 0.001, 0.02],
}


@pytest.mark.parametrize("name", IMPERFECT)
def test_a_run_without_an_imperfection_is_among_those_with_it(name):
    experiment = rs.load_scenario(examples.path("eye_in_hand")).with_(duration=2.0)
    check_same(experiment.vary({name: IMPERFECT[name]}))


@pytest.mark.parametrize("name", ["velocity", "acceleration", "encoder"])
def test_each_joint_has_a_number_of_its_own_in_each_run(name):
    experiment = rs.load_scenario(examples.path("eye_in_hand")).with_(duration=1.0)
    numbers = np.geomspace(0.005, 0.5, 3)[:, None] * np.linspace(0.5, 1.0, 7)
    check_same(experiment.vary({f"actuation.{name}": numbers}))
    with pytest.raises(rs.errors.InputError, match=f"actuation: 6 numbers of {name} for 7"):
        experiment.vary({f"actuation.{name}": numbers[:, 1:]}).run()


FILTER = {"task.depth": rs.laws.DepthFilter(1.0)}
ACTING = {  # fields of laws, weightings and shaping, with the changes that make them act
    "task.law.length": ([0.05, 0.3, 1.0], {"task.law": "camera"}),
    "task.weighting.0.noise": ([1.0, 300.0, 1000.0], {"task.weighting": rs.weights.Tukey()}),
    "task.weighting.0.width": ([20.0, 200.0, 390.0], {"task.weighting": rs.weights.Border()}),
    "task.weighting.0.time": ([0.1, 0.4, 1.0], {"task.weighting": rs.weights.Fade()}),
    "task.secondary.gain": ([0.1, 0.5, 2.0], {}),
    "task.smooth_start": ([0.5, 1.0, 5.0], {}),
    "task.limit.joint": ([0.01, 0.05, 5.0], {"task.limit": rs.laws.SpeedLimit(joint=1.0)}),
    "task.limit.linear": ([0.005, 0.05, 5.0], {"task.limit": rs.laws.SpeedLimit(linear=1.0)}),
    "task.limit.angular": ([0.01, 0.05, 5.0], {"task.limit": rs.laws.SpeedLimit(joint=1.0)}),
    "task.feed_forward.lag": ([0.05, 0.2, 1.0], {"task.feed_forward": rs.laws.EstimatedMotion()}),
    "task.depth.start": ([0.5, 1.0, 2.0], FILTER),
    "task.depth.start_sigma": ([0.1, 0.5, 1.0], FILTER),
    "task.depth.noise": ([0.1, 0.5, 2.0], FILTER),
    "belief.cameras.camera.focal": ([400.0, 500.0, 600.0], FILTER),
    "task.roll": ([0.5, 1.0, 2.0], {"task.kind": "partitioned"}),
    "task.advance": ([0.1, 0.5, 1.0], {"task.kind": "partitioned"}),
    "task.length": ([0.05, 0.3, 1.0], {"task.kind": "partitioned"}),
}


@pytest.mark.filterwarnings("ignore::robsim.errors.RankWarning")
@pytest.mark.parametrize("name", ACTING)
def test_numbers_of_laws_weightings_and_shaping_differ(name):
    numbers, changes = ACTING[name]
    hidden = rs.Sensing(occlusions=rs.imperfections.Occlusion(0, 0.2, 0.6))
    experiment = rs.load_scenario(examples.path("eye_in_hand")).with_(duration=1.0, sensing=hidden)
    runs = check_same(experiment.at(changes).vary({name: numbers}))
    assert len(np.unique(runs.q_end.values, axis=0)) == RUNS


def test_an_effect_of_ones_own_has_the_time_of_each_run():
    experiment = rs.load_scenario(examples.path("eye_in_hand")).with_(duration=1.0)
    shifted = experiment.with_(sensing=rs.Sensing(effects=Shifted()))
    check_same(shifted.vary({"sensing.latency": [0.0, 0.03, 0.1, 0.03]}))


def test_marks_are_hidden_at_other_times_in_each_run():
    experiment = rs.load_scenario(examples.path("eye_in_hand")).with_(duration=1.0)
    hidden = experiment.with_(
        sensing=rs.Sensing(occlusions=rs.imperfections.Occlusion(0, 0.2, 0.6))
    )
    check_same(
        hidden.vary(
            {
                "sensing.occlusions.0.start": [0.1, 0.2, 0.5],
                "sensing.occlusions.0.end": [0.6, 0.9, 0.7],
            }
        )
    )


def test_all_imperfections_differ_at_once():
    experiment = rs.load_scenario(examples.path("visp_tutorial")).with_(duration=2.0)
    made = {name: [*values[1:], values[1]] for name, values in IMPERFECT.items()}
    check_same(experiment.vary({**made, "sensing.outlier_size": [5.0, 20.0, 40.0]}))


def test_the_short_form_names_the_varied_numbers_and_the_number_of_runs(wrong):
    assert "varied     in 3 runs belief.cameras.camera.focal>" in repr(wrong)
    assert "in 3 runs" in wrong._repr_html_()
