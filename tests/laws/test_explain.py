"""`explain` names the true cause: every run here is built so that its cause is known."""

import re
import signal
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import robsim as rs
from robsim import examples
from robsim.world.imperfections.latency import delay_limit

pytestmark = pytest.mark.filterwarnings("ignore::robsim.errors.RankWarning")
SQUARE = np.array([[-0.1, -0.1, 0], [0.1, -0.1, 0], [0.1, 0.1, 0], [-0.1, 0.1, 0]])


def eye(focal=500.0, size=(640, 480), **where):
    K = [[focal, 0, 320], [0, focal, 240], [0, 0, 1]]
    return rs.MountedCamera("eye", rs.Camera(K, size), on="free_camera.body", **where)


def flying(marks=SQUARE, camera=None, more=(), **others):
    """A free camera that sees a square from 1 m at home."""
    square = rs.Object("square", marks=marks, pose=rs.Pose.at(0, 0, 1))
    return rs.Scene([rs.robots.free_camera(), *more], [square], [camera or eye()], **others)


def at(x=0.0, y=0.0, z=0.0, rotvec=(0.0, 0.0, 0.0)):
    return rs.Pose.at(x, y, z, rotvec=rotvec).q


START = at(0.1, -0.05, -0.2, (0.1, -0.1, 0.3))
AS_BELIEVED = flying(camera=eye(550.0))  # a focal length 10 percent too long, which does no harm
TURNED = flying(camera=eye(pose=rs.Pose.at(0, 0, 0, rotvec=(0, 0, 2.0))))


def fly(task, q0=START, scene=None, **settings):
    return rs.simulate(scene or flying(), task, q0, **settings)


def example(name, *changes, **settings):
    return rs.load_scenario(examples.path(name), changes).run(**settings)


@cache
def run_of(made):
    """The run, made once for all that look at it."""
    return made()


@cache
def explained(made):
    return rs.explain(run_of(made))


def local_minimum():
    return example("local_minimum")


def late():
    """Three periods; the noise and the wrong focal length do no harm."""
    task = rs.IBVS(gain=15.0, belief=AS_BELIEVED, tolerance=1e-3)
    return fly(task, sensing=rs.Sensing(noise=0.05, latency=0.12))


def deep():
    return fly(rs.IBVS(gain=10.0, depth_scale=6.0, belief=AS_BELIEVED))


def uneven():
    return fly(rs.IBVS(depth_scale=(0.1, 4.0, 0.1, 4.0)))


def half_turn():
    return example("camera_retreat", 'start.rotvec="0, 0, 180 deg"')


def limited():
    """A Puma with a forearm that would have to pass -200 degrees on its path."""
    scene = rs.load_scenario(examples.path("wrong_calibration")).scene
    links = list(scene.robots[0].links)
    limits = (float(np.radians(-200)), float(np.radians(-184)))
    links[3] = replace(links[3], joint=replace(links[3].joint, limits=limits))
    scene = scene.replacing(replace(scene.robots[0], links=tuple(links)))
    return rs.simulate(scene, rs.IBVS(), np.radians([5, 82, -196, 4, -65, 20]))


def stretched():
    """Stretched, both joints of the arm move its camera sideways only."""
    two = rs.Robot.from_dh([[0, 0, 1, 0], [0, 0, 1, 0]], name="arm")
    camera = rs.MountedCamera("eye", eye(size=None).camera, on="arm.link2")
    above = two.fk([0.3, -0.6])[:3, 3] + (0, 0, 1)
    scene = rs.Scene([two], [rs.Object("dot", marks=above[None])], [camera])
    return rs.simulate(scene, rs.IBVS(goal=[0.3, -0.6]), [0.0, 0.0])


def noisy():
    return fly(rs.IBVS(belief=AS_BELIEVED), sensing=rs.Sensing(noise=0.5))


def slow():
    return fly(rs.IBVS(gain=0.3))


def lost_by_pose():
    """A large square, turned by 85 degrees: its corners leave the image half way."""
    return fly(rs.PBVS(), at(rotvec=(0, 0, np.radians(85))), flying(4 * SQUARE))


def moving():
    belt = rs.robots.conveyor()
    square = rs.Object("square", marks=SQUARE, pose=rs.Pose.at(0, 0, 1), on="conveyor.belt")
    scene = rs.Scene(
        [rs.robots.free_camera(), belt], [square], [eye(size=None)], [rs.Motion("conveyor", [0.02])]
    )
    task = rs.IBVS(gain=2.0, depth="goal")
    sensing = rs.Sensing(noise=1e-4)
    return rs.simulate(scene, task, {"free_camera": START}, sensing=sensing)


def turned_hand_eye():
    sensing = rs.Sensing(noise=0.001, latency=0.04)
    return fly(rs.IBVS(belief=TURNED), sensing=sensing)


def stalled():
    return example("camera_law_stalls")


def lagging():
    joints = rs.Actuation(lag=0.5)
    return fly(rs.IBVS(gain=20.0), sensing=rs.Sensing(noise=1e-4), actuation=joints)


def rounded():
    scene = flying(camera=eye(503.3))
    return fly(rs.IBVS(), scene=scene, sensing=rs.Sensing(quantisation=1.0), duration=20)


def coarse():
    """Encoders that measure little more than the sign of a joint: J belongs to another posture."""
    wrong = {"actuation": rs.Actuation(encoder=2.5), "sensing": rs.Sensing(latency=0.04)}
    return example("eye_to_hand", duration=15, **wrong)


def too_far():
    """A constant depth of 8 m in L, while the true one is some 1.2 m."""
    return fly(rs.IBVS(gain=10.0, depth=8.0))


def lossy():
    scene = flying(camera=eye(size=None))
    task = rs.IBVS(gain=24.0, tolerance=1e-8)
    return fly(task, scene=scene, sensing=rs.Sensing(dropped=0.8), duration=1.0)


def wrong_base():
    scenario = rs.load_scenario(examples.path("eye_to_hand"))
    arm = replace(scenario.scene.robots[0], base=rs.Pose.at(0, 0, 0, rotvec=(0, 0, 2.2)))
    task = replace(scenario.task, belief=scenario.scene.replacing(arm))
    return rs.simulate(scenario.scene, task, scenario.start, duration=20)


WILD = rs.IBVS(tolerance=1e-3)


def wild_marks():
    return fly(WILD, sensing=rs.Sensing(noise=0.05, outliers=0.05))


def rare():
    scene = flying(camera=eye(size=None))
    return fly(rs.IBVS(gain=12.0), scene=scene, sensing=rs.Sensing(period=0.2, noise=1e-4))


def weak():
    return fly(rs.IBVS(gain=2.0), actuation=rs.Actuation(velocity=0.02))


def too_fast():
    return fly(rs.IBVS(gain=60.0))


def behind():
    scene = flying(camera=eye(size=None))
    return fly(rs.IBVS(interaction="desired"), at(rotvec=(0, 0, 3.0)), scene, dt=0.02)


def blind_start():
    return fly(rs.IBVS(), at(2.0))


def sluggish():
    return fly(rs.IBVS(gain=5.0), actuation=rs.Actuation(acceleration=0.1))


def too_fast_with_a_mean():
    """An arm that loses its target at once: L mean would mislead it, but a gain dt of 2.4 does."""
    return example("eye_in_hand", "task.gain=60")


def transposed():
    """(L J)' (L J) is far from 1, and so is the limit of the gain."""
    return fly(rs.IBVS(gain=80.0, inverse="transpose"), at(0.05))


def adaptive():
    return fly(rs.IBVS(gain=rs.laws.AdaptiveGain(60.0, 1.0, 30.0)), at(0.05))


def hardly_any_gain():
    return fly(rs.IBVS(gain=1e-4), at(0.05))


def one_period():
    return fly(rs.IBVS(), duration=0.04)


def given_in_pixels():
    """Numbers in pixels for features that are normalised."""
    return fly(rs.IBVS(goal=rs.GoalFeatures([10, 10, 60, 10, 60, 60, 10, 60.0])), at())


def wheels():
    return example("unicycle_docking", "task.kind=ibvs")


def hindered():
    return fly(rs.IBVS(gain=3.0, limit=rs.laws.SpeedLimit(linear=0.01, angular=0.02)))


def damped():
    return fly(rs.IBVS(inverse=rs.laws.DampedInverse(1.0)), at(0.05))


def wrong_links():
    scenario = rs.load_scenario(examples.path("eye_to_hand"))
    task = replace(scenario.task, belief=scenario.scene.believe(dh={"forearm": {"alpha": 1.5}}))
    return rs.simulate(scenario.scene, task, scenario.start)


def skewed(**settings):
    """A square with one corner pulled out: as no pose shows it."""
    goal = np.array([-0.1, -0.1, 0.1, -0.1, 0.1, 0.1, -0.12, 0.1])
    return fly(rs.IBVS(goal=rs.GoalFeatures(goal)), **{"duration": 20.0} | settings)


def skewed_and_short():
    return skewed(duration=3.0)


# its experiment, its outcome, the subject of the first cause, and words of its sentence
KNOWN = [
    (local_minimum, "LOCAL_MINIMUM", "local minimum", "k = 8 numbers and L J has rank 6"),
    (late, "OUT_OF_IMAGE", "latency", r"3 control periods: .* exceeds 0\.445, and it is 0\.6"),
    (deep, "OUT_OF_IMAGE", "depth scale", r"All depths of the law are 6 times .* is 2\.4.* from 2"),
    (uneven, "TIME_LIMIT", "depth scale", r"factors from 0\.1 to 4, different for each mark"),
    (half_turn, "DIVERGED", "camera retreat", "1 m away .* 180 degrees about the optical axis"),
    (limited, "JOINT_LIMIT", "joint limit", "lower limit of joint 'forearm' is the only obstacle"),
    (stretched, "SINGULAR", "singularity", "from 2 to 1: no error changes when link1 and link2"),
    (noisy, "TIME_LIMIT", "noise", r"noise of 0\.5 px: .* tolerance is 1e-05"),
    (slow, "TIME_LIMIT", "too little time", r"gain of 0\.3 per second.* after 32\.7 s"),
    (lost_by_pose, "OUT_OF_IMAGE", "no control of the image", "position-based"),
    (moving, "TIME_LIMIT", "own motion", r"'conveyor' moves on its own.*/ 2 = 0\.00625"),
    (turned_hand_eye, "OUT_OF_IMAGE", "hand-eye", "115 degrees: beyond 90 degrees"),
    (stalled, "LOCAL_MINIMUM", "camera law", r"5 of 6 degrees of freedom, .* J\^\+ V = 0"),
    (lagging, "TIME_LIMIT", "lag", r"lag of 0\.5 s: .* damping ratio of the loop is 0\.158"),
    (rounded, "TIME_LIMIT", "quantisation", "rounded to 1 px"),
    (wild_marks, "TIME_LIMIT", "outliers", "5 percent of the marks"),
    (coarse, "TIME_LIMIT", "encoder", r"steps of 2\.5 \(rad or m\)"),
    (too_far, "BEHIND_CAMERA", "depth", "taken as 8 m, not the true depth, between"),
    (lossy, "BEHIND_CAMERA", "dropped", "80 percent of the images are lost"),
    (wrong_base, "JOINT_LIMIT", "base", "'puma560' is off by 126 degrees"),
    (rare, "TIME_LIMIT", "period", r"every 0\.2 s only, 5 control periods.* is 2\.4"),
    (weak, "TIME_LIMIT", "velocity", "velocity limits of the joints change the command in 100"),
    (sluggish, "TIME_LIMIT", "acceleration", "acceleration limits of the joints"),
    (too_fast, "OUT_OF_IMAGE", "gain", r"gain times period is 2\.4.* stable below 2"),
    (behind, "BEHIND_CAMERA", "rotation about the axis", "172 degrees about the optical axis"),
    (blind_start, "OUT_OF_IMAGE", "start", "does not see all marks"),
    (too_fast_with_a_mean, "BEHIND_CAMERA", "gain", r"gain times period is 2\.4"),
    (transposed, "OUT_OF_IMAGE", "gain", r"with this inverse .* stable below about 0\.0304"),
    (adaptive, "TIME_LIMIT", "gain", r"is 2\.4, .* 1\.4 times .* stable below 2\."),
    (hardly_any_gain, "TIME_LIMIT", "too little time", r"falls at 0\.0001 per second, with a gain"),
    (one_period, "TIME_LIMIT", "too little time", r"below the tolerance after 9\.68 s"),
    (given_in_pixels, "BEHIND_CAMERA", "goal", r"largest is 60, and at the start 0\.1\."),
    (skewed, "LOCAL_MINIMUM", "unreachable goal", r"no pose .* has them: .* length 0\.0038, and"),
    (skewed_and_short, "TIME_LIMIT", "unreachable goal", "no pose of the camera has them"),
    (wheels, "LOCAL_MINIMUM", "local minimum", "too few for 8 numbers, which need 6"),
    (hindered, "TIME_LIMIT", "too little time", "speed limit of the task slows the command"),
    (damped, "TIME_LIMIT", "too little time", r"with a gain of 1 per second, and at that rate"),
    (wrong_links, "JOINT_LIMIT", "robot model", "believed links of 'puma560' are wrong: 'forearm'"),
]


@pytest.mark.parametrize(
    ("made", "outcome", "about", "words"), KNOWN, ids=[row[0].__name__ for row in KNOWN]
)
@pytest.mark.few(8)
def test_the_true_cause_is_named(made, outcome, about, words):
    explanation = explained(made)
    assert explanation.outcome.name == outcome, explanation
    assert explanation.causes[0].about == about, explanation
    assert re.search(words, explanation.causes[0].sentence), explanation
    text = str(explanation)
    assert text.startswith(explanation.what) and "Why: " in text and "nan" not in text
    assert all(np.isfinite(value) for value in explanation.causes[0].evidence.values())


@pytest.mark.parametrize("made", [late, deep, noisy, turned_hand_eye, moving, lagging, wild_marks])
def test_a_harmless_fault_is_reported_as_such(made):
    explanation = explained(made)
    assert len(explanation.causes) == 1
    assert any("Not the cause, though wrong as well" in remark for remark in explanation.remarks)


def test_two_that_do_harm_only_together_are_both_named():
    """One period late and depths 2.5 times too large: gain dt = 0.6 bears each, not both."""
    task, sensing = rs.IBVS(gain=15.0, depth_scale=2.5), rs.Sensing(latency=0.04, noise=1e-4)
    explanation = rs.explain(fly(task, sensing=sensing))
    assert [cause.about for cause in explanation.causes] == ["latency", "depth scale"]
    assert (
        "Only the combination of latency and the wrong depths is harmful" in explanation.remarks[0]
    )
    assert "pixel noise" in explanation.remarks[1]


def test_two_each_of_which_is_enough_are_put_right_together():
    """Six times the depth and a camera turned by 115 degrees: each alone loses the square."""
    task = rs.IBVS(gain=10.0, depth_scale=6.0, belief=TURNED)
    explanation = rs.explain(fly(task))
    assert [cause.about for cause in explanation.causes] == ["depth scale and hand-eye"]
    assert "Correcting one of them is not enough" in explanation.causes[0].sentence


def test_of_two_together_the_one_that_ended_the_run_is_named_first():
    """Latency loses the square; with noise alone the run would go on, and never be exact."""
    sensing = rs.Sensing(latency=0.12, noise=0.01)
    explanation = rs.explain(fly(rs.IBVS(gain=15.0), sensing=sensing))
    assert [cause.about for cause in explanation.causes] == ["latency and noise"]
    assert "without latency alone the run ends as TIME_LIMIT. Only with" in str(explanation)


def test_a_limit_that_alone_is_in_the_way_is_the_only_cause():
    task = replace(
        rs.load_scenario(examples.path("joint_limits")).task, secondary=None, projection="classic"
    )
    scenario = rs.load_scenario(examples.path("joint_limits"))
    explanation = rs.explain(scenario.run(task=task))
    assert [cause.about for cause in explanation.causes] == ["joint limit"]
    assert "is the only obstacle: without limits the same run converges" in str(explanation)


def test_ways_of_points_are_not_blamed_for_where_a_pose_is_regulated():
    explanation = rs.explain(example("pbvs_loses_target"))
    assert [cause.about for cause in explanation.causes] == ["no control of the image", "border"]


def test_a_fault_that_is_not_the_cause_is_acquitted():
    """A local minimum stays one without the noise."""
    explanation = rs.explain(example("local_minimum", sensing=rs.Sensing(noise=1e-6)))
    assert explanation.causes[0].about == "local minimum"
    words = "Wrong as well: pixel noise; with all of it corrected the run ends as LOCAL_MINIMUM"
    assert explanation.remarks[0].startswith(words)


def test_a_run_that_needs_only_time_is_not_blamed_on_a_slow_part():
    explanation = rs.explain(example("wrong_calibration", duration=6.0))
    assert [cause.about for cause in explanation.causes] == ["too little time"]
    assert explanation.remarks[0].endswith("but the run only needs more time.")
    assert "the intrinsics of 'camera'" in explanation.remarks[0]


def test_a_camera_law_that_climbs_is_found_before_it_stalls():
    explanation = rs.explain(example("camera_law_stalls", duration=6.0))
    assert (
        explanation.causes[0].about == "camera law"
        and explanation.causes[0].evidence["steepest"] > 0.01
    )
    assert "law" in [advice.about for advice in explanation.advice]


def test_a_local_minimum_is_one():
    """V is larger all around the point of rest of the run."""
    run = run_of(local_minimum)
    explanation = explained(local_minimum)
    assert explanation.causes[0].evidence["least_curvature"] > 0
    scene = rs.load_scenario(examples.path("local_minimum")).scene
    robot, camera = scene.robots[0], scene.cameras[0].camera
    goal = camera.normalise(run.pixels_goal.values)

    def V(q):
        return 0.5 * ((camera.normalise(scene.view(q).pixels) - goal) ** 2).sum()

    rng, here = np.random.default_rng(0), V(run.q_end.values)
    around = [robot.integrate(run.q_end.values, 1e-2 * rng.normal(size=6), 1.0) for _ in range(200)]
    assert min(V(q) for q in around) > here == pytest.approx(float(run.lyapunov.dropna("time")[-1]))


def test_the_advice_was_tried():
    explanation = explained(local_minimum)
    assert [advice.about for advice in explanation.advice] == ["interaction", "interaction", "PBVS"]
    for advice, which in zip(explanation.advice, ("mean", "desired"), strict=False):
        run = example("local_minimum", f"task.interaction={which}")
        assert rs.Outcome(int(run.outcome)) == rs.Outcome.CONVERGED
        assert advice.evidence["converges_after_s"] == float(run.end_time)
        assert f"With L {which} the same start converges" in advice.sentence


def test_advice_for_a_moving_target_is_feed_forward():
    explanation = explained(moving)
    assert [advice.about for advice in explanation.advice][:2] == ["feed_forward", "feed_forward"]
    assert explanation.causes[0].evidence["drift"] == pytest.approx(0.0125, rel=1e-3)
    lag = float(abs(run_of(moving).error[-1]).max())
    assert explanation.causes[0].evidence["lag"] == pytest.approx(lag, rel=0.1)  # the first order


@pytest.mark.parametrize(
    ("made", "advice"),
    [
        (wheels, "With Docking the same start converges"),
        (hindered, "Without its speed limit the same start converges"),
        (damped, "With inverse='pseudo_inverse' the same start converges"),
        (slow, "With four times the gain (1.2 per second) the same start converges"),
        (lambda: fly(rs.IBVS(interaction=np.eye(8, 6)), duration=5), "With L mean the same start"),
        (lambda: fly(rs.PBVS(), sensing=rs.Sensing(noise=0.1)), "With a tolerance of 0.017 m"),
    ],
)
def test_the_obvious_is_advised(made, advice):
    explanation = explained(made)
    assert advice in str(explanation), explanation


def test_where_only_time_is_lacking_no_other_law_and_no_lower_gain_is_advised():
    for made in (slow, weak):
        explanation = explained(made)
        assert not any(
            "half" in one.sentence or "law" in one.about for one in explanation.advice
        ), explanation


def test_an_error_of_metres_is_reported_in_metres():
    message = str(rs.explain(fly(rs.PBVS(), sensing=rs.Sensing(noise=0.1))))
    assert re.search(r"stays at about \S+ m, and the tolerance is 1e-05 m\.", message)


def test_the_wrong_intrinsics_are_reported_and_no_more():
    goal = rs.GoalPose(rs.Pose.at(0, 0, 0.6))
    bent = rs.Camera(eye().camera.K, (640, 480), distortion=(-0.3, 0.1, 0, 0))
    scene = flying(camera=rs.MountedCamera("eye", bent, on="free_camera.body"))
    explanation = rs.explain(fly(rs.IBVS(goal, belief=flying()), at(), scene))
    words = "intrinsics of 'eye' are wrong: distortion none, true (-0.3, 0.1, 0, 0). With"
    assert words in explanation.causes[1].sentence
    assert (
        "the true pose of the camera is 10.1 mm off" in explanation.causes[0].sentence
    )  # not turned
    aside = flying().believe(center=(20, 0))
    explanation = rs.explain(fly(rs.IBVS(rs.GoalPose(rs.Pose.at(0, 0, 1)), belief=aside), at(0.05)))
    assert "wrong: centre (340, 240) px, true (320, 240) px. With" in explanation.causes[1].sentence
    assert "40 mm off" in explanation.causes[0].sentence  # 20 px / 500 px of 1 m


def test_a_camera_for_which_nothing_is_wrong_may_stand_elsewhere():
    """Three marks have four solutions, and a coarse tolerance leaves a way to go."""
    far, three = (
        at(0.5, 0.3, -0.2, (0.4, -0.5, 0.5)),
        rs.features.FeatureBlock("points", marks=[0, 1, 2]),
    )
    explanation = rs.explain(
        fly(rs.IBVS(features=three), far, flying(camera=eye(size=None)), duration=20)
    )
    assert [cause.about for cause in explanation.causes] == ["final pose", "ambiguous features"]
    for belief in (None, AS_BELIEVED):
        explanation = rs.explain(fly(rs.IBVS(tolerance=1e-2, belief=belief)))
        assert [cause.about for cause in explanation.causes] == ["final pose", "tolerance"]
        assert "with 1e-05 the camera reaches its goal pose" in str(explanation)


def test_the_error_within_a_tolerance_does_not_hide_the_cause():
    larger, goal = flying().believe(size=1.2), rs.GoalPose(rs.Pose.at(0, 0, 1))
    task, sensing = rs.PBVS(goal, belief=larger, tolerance=1e-2), rs.Sensing(noise=0.05)
    explanation = rs.explain(fly(task, sensing=sensing, duration=20))
    assert [cause.about for cause in explanation.causes] == ["final pose", "target model"]


def test_the_time_that_would_have_been_enough_is_reported():
    explanation = explained(slow)
    run = fly(rs.IBVS(gain=0.3), duration=60)
    assert explanation.causes[0].evidence["arrival_s"] == pytest.approx(
        float(run.end_time), rel=0.02
    )


def test_the_mark_that_left_and_the_side_are_reported():
    run = run_of(late)
    explanation, x = explained(late), run.pixels_end.values
    assert "mark 0 of 'square' left the image of 'eye' at the top" in explanation.what
    assert x[0, 1] < -0.5 and explanation.when == float(run.end_time)


def test_the_joint_the_limit_and_its_speed_are_reported():
    run = run_of(limited)
    explanation = explained(limited)
    assert "joint 'forearm' passed its lower limit of -200 degrees" in explanation.what
    speed = np.degrees(abs(float(run.qd[int(run.end_time / 0.04) - 1, 2])))
    assert float(re.search(r"at ([\d.]+) degrees", explanation.what)[1]) == pytest.approx(
        speed, rel=1e-3
    )


@pytest.mark.parametrize(("periods", "limit"), [(0, 2.0), (1, 1.0), (2, 0.618), (3, 0.445)])
def test_the_limit_of_a_delayed_loop_is_where_its_roots_leave_the_circle(periods, limit):
    """z^(d+1) - z^d + g: the largest root has length 1 at the limit."""
    assert delay_limit(periods) == pytest.approx(limit, abs=5e-4)
    polynomial = np.zeros(periods + 2)
    polynomial[0] = 1
    polynomial[1] -= 1
    polynomial[-1] += delay_limit(periods)
    assert np.abs(np.roots(polynomial)).max() == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize(("whole", "part"), [(0, 0.5), (1, 0.25), (2, 0.5), (5, 0.9)])
def test_a_delay_of_a_part_of_a_period_has_a_limit_of_its_own(whole, part):
    """x(k + 1) = x(k) - g ((1 - f) x(k - m) + f x(k - m - 1)): linear between two commands."""
    limit, polynomial = delay_limit(whole + part), np.zeros(whole + 3)
    polynomial[:2] = 1, -1
    polynomial[-2:] += limit * (1 - part), limit * part
    assert np.abs(np.roots(polynomial)).max() == pytest.approx(1.0, abs=1e-9)
    scene, near = flying(camera=eye(size=None)), at(1e-3)
    ends = [
        fly(
            rs.IBVS(gain=share * limit / 0.04, tolerance=1e-5),
            near,
            scene,
            sensing=rs.Sensing(latency=0.04 * (whole + part)),
            duration=60,
        )
        for share in (0.95, 1.05)
    ]
    assert [rs.Outcome(int(run.outcome)).name for run in ends] == ["CONVERGED", "DIVERGED"]


def test_the_share_of_the_periods_is_of_those_that_there_were():
    run = fly(rs.IBVS(gain=2.0), actuation=rs.Actuation(velocity=[0.02] * 3 + [0.1] * 3))
    cut = (abs(run.qd.values[:250]) > [0.02] * 3 + [0.1] * 3).any(axis=1)
    explanation = rs.explain(run)
    assert (
        explanation.causes[0].about == "velocity"
        and explanation.causes[0].evidence["share"] == cut.mean()
    )


# ---- what did not fail ----


def test_a_run_that_converged_needs_no_cause():
    explanation = rs.explain(fly(rs.IBVS(gain=2.0)))
    assert (
        explanation.outcome is rs.Outcome.CONVERGED
        and not explanation.causes
        and not explanation.advice
    )
    what = "After 4.76 s the run converged: every error is below the tolerance of 1e-05."
    assert str(explanation) == explanation.what == what


def test_the_explanation_of_a_wrongly_converged_camera_has_its_true_place():
    goal = 'task.goal.computed={position="0, 0, 50 cm", rpy="0, 180, 0 deg"}'
    run = example("wrong_calibration", goal)
    explanation = rs.explain(run)
    scene = rs.load_scenario(examples.path("wrong_calibration")).scene
    q = run.q_end.values
    depth = (scene.pose("camera", q).inv() @ scene.pose("plate", q)).position[2]
    assert explanation.causes[0].evidence["off_m"] == pytest.approx(abs(depth - 0.5), rel=1e-3)
    assert [cause.about for cause in explanation.causes] == ["final pose", "intrinsics"]
    assert "82.5 mm" in explanation.causes[0].sentence and "focal length 960 px" in str(explanation)
    assert "Note: " in str(explanation) and "Why: " not in str(explanation)


def test_hidden_marks_and_a_wrong_model_leave_a_camera_elsewhere():
    hidden = rs.Sensing(occlusions=rs.imperfections.Occlusion((0, 1), 0.5), noise=1e-7)
    explanation = rs.explain(fly(rs.IBVS(), sensing=hidden))
    assert [cause.about for cause in explanation.causes] == ["final pose", "occlusions"]
    larger, goal = flying(1.3 * SQUARE), rs.GoalPose(rs.Pose.at(0, 0, 1))
    explanation = rs.explain(fly(rs.PBVS(goal, belief=larger), duration=20))
    assert [cause.about for cause in explanation.causes] == ["final pose", "target model"]
    assert explanation.causes[0].evidence["off_m"] == pytest.approx(0.3 / 1.3, rel=1e-3)


def test_the_explanation_of_a_held_run_has_its_state_at_the_end():
    task, sensing = rs.IBVS(gain=15.0), rs.Sensing(latency=0.12)
    explanation = rs.explain(
        fly(task, START, flying(camera=eye(size=None)), sensing=sensing, hold=True)
    )
    assert explanation.causes[0].about == "latency"
    assert "Without latency, the same run ends converged" in explanation.causes[0].sentence
    explanation = rs.explain(fly(rs.IBVS(gain=2.0), hold=True))
    assert explanation.what.startswith("After 10 s, at the end of the run, every error is below")


def test_a_retreat_and_a_mark_near_the_border_are_noted():
    explanation = rs.explain(example("camera_retreat"))
    assert explanation.outcome is rs.Outcome.CONVERGED
    assert [cause.about for cause in explanation.causes] == ["camera retreat"]
    assert explanation.causes[0].evidence["roll_deg"] == pytest.approx(120)


class Interrupting:
    """An effect that changes nothing; Ctrl-C comes during its third image."""

    images = 0

    def seen(self, pixels, exposure):
        self.images += 1
        if self.images == 3:
            signal.raise_signal(signal.SIGINT)
        return pixels


def test_the_explanation_of_a_stopped_run_has_its_expected_end():
    whole = fly(rs.IBVS(gain=2.0))
    task, sensing = rs.IBVS(gain=2.0), rs.Sensing(effects=[Interrupting()])
    stopped = rs.Experiment(flying(), task, START, sensing=sensing)
    with pytest.raises(rs.errors.Interrupted) as stop:
        stopped.run()
    explanation = rs.explain(stop.value.run, stopped)
    assert explanation.outcome is rs.Outcome.RUNNING and "stopped by the user" in explanation.what
    ended = f"Without the stop it ends as CONVERGED after {float(whole.end_time):.3g} s."
    assert explanation.remarks == (ended,)


# ---- users' code, summaries, batches, and runs that cannot be explained ----


class Half(rs.laws.JointLaw):
    """A user's law."""

    def command(self, state):
        return 0.5 * super().command(state)


class Idle(rs.laws.JointLaw):
    """A law that commands nothing."""

    def command(self, state):
        return 0.0 * super().command(state)


class Broken(rs.laws.JointLaw):
    """A law that is not finite near the goal."""

    def command(self, state):
        small = np.abs(state.error).max(axis=1, keepdims=True) < 0.02
        return np.where(small, np.nan, super().command(state))


class Blind(rs.features.Points):
    """A feature that is not finite in the middle of the way."""

    def measure(self, seen):
        Z = seen.depth[:, :1]
        return np.where((Z > 1.05) & (Z < 1.1), np.nan, super().measure(seen))


@pytest.mark.parametrize(
    ("task", "outcome", "about"),
    [
        (rs.IBVS(law=Half(), gain=0.3), "TIME_LIMIT", "too little time"),
        (rs.IBVS(law=Idle()), "LOCAL_MINIMUM", "law"),
        (rs.IBVS(law=Broken()), "NOT_FINITE", "law"),
        (rs.IBVS(features=Blind()), "NOT_FINITE", "feature"),
    ],
)
def test_a_task_of_python_code_is_given_with_its_scene(task, outcome, about):
    scene = flying()
    run = fly(task, scene=scene)
    with pytest.raises(rs.errors.InputError, match="Python code; give the experiment of the run"):
        rs.explain(run)
    explanation = rs.explain(run, rs.Experiment(scene, task))
    assert explanation.outcome.name == outcome and explanation.causes[0].about == about


def test_a_given_experiment_must_be_the_one_that_made_the_run():
    task, scene = rs.IBVS(law=Half()), flying()
    run = fly(task, scene=scene, sensing=rs.Sensing(noise=0.1))
    with pytest.raises(rs.errors.InputError, match=r"made with sensing=Sensing\(noise=0.1"):
        rs.explain(run, rs.Experiment(scene, task))
    noisy = rs.Experiment(scene, task, sensing=rs.Sensing(noise=0.1))
    with pytest.raises(rs.errors.InputError, match=r"this run is not reproduced: q\["):
        rs.explain(run, noisy.with_(task=rs.IBVS()))
    with pytest.raises(
        rs.errors.InputError, match="experiment: expected an Experiment, got <Scene"
    ):
        rs.explain(run, scene)
    assert rs.explain(run, noisy).causes


def test_a_run_of_a_batch_is_explained_as_it_was_there():
    starts = np.stack([START, at(0.05), START])
    runs = fly(rs.IBVS(), starts, sensing=rs.Sensing(noise=0.3), record="summary")
    with pytest.raises(
        rs.errors.InputError, match=r"expected one run, got 3: pick one, as in run.isel"
    ):
        rs.explain(runs)
    explanation = rs.explain(runs.isel(run=2))
    assert explanation.causes[0].about == "noise"
    assert str(explanation) == str(rs.explain(runs.isel(run=[2])))
    assert str(explanation) != str(rs.explain(runs.isel(run=0)))  # its noise is its own


@pytest.mark.parametrize("given", [None, 3, "run.nc"])
def test_what_is_no_run_is_refused(given):
    with pytest.raises(rs.errors.InputError, match="expected a run"):
        rs.explain(given)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda run: run.drop_vars("q0"), "it has no 'q0'"),
        (lambda run: run.drop_vars("outcome"), "no outcome and end_time"),
        (lambda run: run.drop_vars("end_time"), "no outcome and end_time"),
        (lambda run: run.assign(outcome=99), "no number 99 in Outcome"),
        (lambda run: run.assign(end_time=np.nan), "its end_time is nan s"),
        (lambda run: run.assign(end_time=1e9), "at most 50000 can be simulated again"),
        (
            lambda run: run.assign_attrs(dt="abc"),
            "was changed after RobSim made it: could not convert",
        ),
        (lambda run: run.assign_attrs(dt=np.nan), "was changed after RobSim made it"),
        (lambda run: run.assign_attrs(duration=np.inf), "was changed after RobSim made it"),
        (lambda run: run.assign_attrs(record=0), "record must be a whole number from 1 on"),
        (lambda run: run.q, "expected a run, a Dataset"),
    ],
)
def test_a_part_of_a_run_or_a_changed_one_is_refused(change, message):
    with pytest.raises(rs.errors.InputError, match=message):
        rs.explain(change(run_of(slow)))


def test_arguments_beside_a_run_are_checked():
    run = run_of(slow)
    with pytest.raises(rs.errors.InputError, match="experiment: expected an Experiment, got 3"):
        rs.explain(run, 3)
    with pytest.raises(rs.errors.InputError, match="trials must be True or False, got 'no'"):
        rs.explain(run, trials="no")


def test_without_trials_the_run_is_read_only():
    explanation = rs.explain(run_of(late), trials=False)
    assert not explanation.advice and explanation.outcome is rs.Outcome.OUT_OF_IMAGE
    assert explanation.remarks == (
        "Also wrong in this run, and not examined: pixel noise, latency and "
        "the intrinsics of 'eye'.",
    )


class Wrapped:
    """A task of a user's own kind, with an unknown gain."""

    def __init__(self, task):
        self.task = task

    def columns(self, scene):
        return self.task.columns(scene)

    def bind(self, scene, columns=None):
        return self.task.bind(scene, columns)


def test_a_task_with_an_unknown_gain_has_no_gain_in_its_explanation():
    scene, task = flying(), Wrapped(rs.IBVS(gain=0.2))
    explanation = rs.explain(fly(task, scene=scene), rs.Experiment(scene, task))
    assert "falls at 0.201 per second, and" in explanation.causes[0].sentence and "nan" not in str(
        explanation
    )
    for sensing, actuation in (
        (rs.Sensing(latency=0.12), rs.Actuation()),
        (rs.Sensing(period=0.4), rs.Actuation()),
        (rs.Sensing(), rs.Actuation(lag=1.0)),
    ):
        task, wrong = Wrapped(rs.IBVS(gain=15.0)), {"sensing": sensing, "actuation": actuation}
        explanation = rs.explain(
            fly(task, scene=scene, **wrong), rs.Experiment(scene, task, **wrong)
        )
        assert explanation.causes and "nan" not in str(explanation)
        assert not explanation.advice  # nothing of it can be changed
        assert all(np.isfinite(value) for value in explanation.causes[0].evidence.values())


TASKS = {
    "switch": rs.Switch(rs.PBVS(gain=0.3), rs.IBVS(gain=0.3), rs.tasks.ErrorBelow(0.1)),
    "priorities": rs.Priorities([rs.IBVS(gain=0.3), rs.PBVS(gain=0.3)]),
    "hybrid": rs.Hybrid(gain=0.3),
    "partitioned": rs.Partitioned(gain=0.3, roll=0.3, advance=0.3),
    "adaptive": rs.IBVS(gain=rs.laws.AdaptiveGain(0.4, 0.2, 1.0)),
    "broyden": rs.IBVS(gain=0.3, interaction=rs.laws.Broyden()),
    "filter": rs.IBVS(gain=0.3, depth=rs.laws.DepthFilter(1.0)),
    "transpose": rs.IBVS(gain=0.3, inverse="transpose"),
}


@pytest.mark.parametrize("name", TASKS)
def test_every_kind_of_task_is_explained(name):
    explanation = rs.explain(fly(TASKS[name], at(0.05, 0.02, -0.05, (0, 0, 0.1)), duration=2))
    assert explanation.outcome is rs.Outcome.TIME_LIMIT and explanation.causes
    assert explanation.causes[0].about in ("too little time", "depth", "standing error")


ALONE = [name for name in examples.names() if not name.startswith("inspection")]  # no missions


@pytest.mark.parametrize(
    "name",
    [
        name if k % 8 == 0 else pytest.param(name, marks=pytest.mark.full)
        for k, name in enumerate(ALONE)
    ],
)
@pytest.mark.few(3)
def test_every_example_is_explained(name):
    run = example(name, duration=3.0)
    explanation = rs.explain(run)
    assert (
        explanation.when == float(run.end_time)
        and str(explanation)
        and "nan" not in str(explanation)
    )


def test_the_best_that_no_pose_can_better_is_where_the_run_stood_still():
    """Two searches: `explain` searches from everywhere, and the servo loop from its start."""
    run = skewed()
    explanation = rs.explain(run, trials=False).causes[0]
    assert explanation.evidence["nearest"] == pytest.approx(
        float(run.error_norm.dropna("time")[-1]), rel=1e-4
    )


@pytest.mark.parametrize(
    ("task", "where"),
    [
        (rs.IBVS(gain=0.1, goal=rs.GoalFeatures((SQUARE[:, :2] / 0.8).ravel())), "800 mm in front"),
        (
            rs.IBVS(gain=0.1, features="pixels", goal=rs.GoalFeatures([250, 250, 350, 250] * 2)),
            None,
        ),
        (rs.IBVS(gain=0.1, goal=rs.GoalFeatures((SQUARE[:, :2] + 5).ravel())), "not see all marks"),
    ],
)
def test_the_pose_of_a_goal_made_of_numbers_is_reported(task, where):
    explanation = rs.explain(fly(task, duration=1.0), trials=False)
    (goal,) = (cause for cause in explanation.causes if "goal" in cause.about)
    assert (where or "no pose of the camera") in goal.sentence, explanation


@pytest.mark.parametrize(
    ("marks", "free"),
    [(SQUARE[[0, 2]], 2), (SQUARE[:1], 4), ([[-0.1, 0, 0], [0, 0, 0], [0.1, 0, 0]], 1)],
)
def test_a_run_that_converged_without_a_fixed_pose_is_reported(marks, free):
    """Of one, two, or three marks on a line: a camera may stand elsewhere with the same image."""
    explanation = rs.explain(fly(rs.IBVS(), scene=flying(marks)))
    assert explanation.outcome is rs.Outcome.CONVERGED
    off, why = explanation.causes[:2]
    assert off.evidence["off_m"] > 0.01 and "off its goal pose" in off.sentence
    assert why.about == "free motions" and why.evidence["free_motions"] == free
    assert "Three or more marks that are not collinear" in why.sentence


def test_of_two_marks_given_as_numbers_there_is_no_pose_to_miss():
    goal = rs.GoalFeatures([-0.1, -0.1, 0.1, 0.1])
    explanation = rs.explain(fly(rs.IBVS(goal=goal), scene=flying(SQUARE[[0, 2]])))
    assert (
        explanation.causes[0].about == "free motions"
        and explanation.causes[0].evidence["free_motions"] == 2
    )


def test_joints_that_move_a_camera_in_two_ways_need_no_more_than_two_numbers():
    explanation = rs.explain(example("pan_tilt_tracking", "run.hold=false", duration=20))
    assert all(cause.about != "free motions" for cause in explanation.causes)


def test_outliers_get_the_advice_of_robust_weights_and_their_places_are_reported():
    advised = rs.explain(wild_marks())
    (weigh,) = [each for each in advised.advice if each.about == "weighting"]
    assert "With weighting='tukey' the same start converges after 5" in weigh.sentence
    weighted = replace(WILD, weighting="tukey")
    worse = rs.Sensing(noise=0.05, outliers=0.2, outlier_size=30.0)
    explanation = rs.explain(fly(weighted, sensing=worse))
    assert "though robust weights are in use." in str(explanation)
    assert not [each for each in explanation.advice if each.about == "weighting"]


@pytest.mark.parametrize("own", ['"fade"', ""])
def test_where_noise_lets_nothing_converge_robust_weights_are_judged_by_the_distance(own):
    """Means over the second half: 24 mm with marks that lie, 4.17 weighted."""
    explanation = rs.explain(example("marks_that_lie", f"task.weighting=[{own}]"))
    (weigh,) = [each for each in explanation.advice if each.about == "weighting"]
    off, was = (1e3 * weigh.evidence[name] for name in ("off_m", "was_off_m"))
    np.testing.assert_allclose([off, was], [4.17, 24.0], rtol=0.01)
    how = "With weighting='tukey' beside the present weighting" if own else "With weighting='tukey'"
    text = f"{how} the mean distance to the goal in the second half of the run is {off:.3g} mm"
    assert weigh.sentence == f"{text} instead of {was:.3g} mm."


def test_robust_weights_that_bring_nothing_are_not_advised():
    """Of marks that lie by no more than noise, and of a goal that is no pose."""
    small = rs.explain(example("marks_that_lie", "sensing.outlier_size=1", "run.duration='4 s'"))
    numbers = rs.IBVS(goal=rs.GoalFeatures([-0.1, -0.1, 0.1, -0.1, 0.1, 0.1, -0.1, 0.1]))
    wild = fly(numbers, sensing=rs.Sensing(noise=1.0, outliers=0.05), duration=4)
    for told in (small, rs.explain(wild)):
        assert told.outcome is rs.Outcome.TIME_LIMIT
        assert not [each for each in told.advice if each.about == "weighting"]
