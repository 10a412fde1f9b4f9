"""Missions: legs that begin at the end of the last one, things that change hands, and outcomes."""

import numpy as np
import pytest

import robsim as rs
from robsim import Experiment, FollowJoints, Mission, Outcome, Phase
from robsim.errors import InputError
from robsim.page.recordings import build_recording

ARM = rs.robots.planar_2r()
CUP = rs.Object("cup", rs.Block(0.1, 0.1, 0.1), marks=[[0, 0, 0.05]], pose=rs.Pose.at(1.2, 0.9, 0))
SCENE = rs.Scene(ARM, CUP)


def go(*to, **more):
    return FollowJoints(to=to, duration=1.0, **more)


def by(*change, **more):
    return FollowJoints(by=change, duration=1.0, **more)


def tell(scene, *phases, start=None, **more):
    return Experiment(scene, Mission(phases), start, **more).run()


def test_each_leg_starts_where_the_last_one_ended_and_time_goes_on():
    story = tell(SCENE, Phase("a", go(0.5, 0.5)), Phase("b", go(1.0, -0.5)))
    first, second = story.legs
    np.testing.assert_array_equal(second.run.q0, first.q_end)
    np.testing.assert_allclose(first.q_end, [0.5, 0.5], atol=1e-12)
    assert (first.start, first.end, second.start, second.end) == (0, 1, 1, 2)
    joined = story.run
    np.testing.assert_allclose(joined.time, np.arange(51) * 0.04, atol=1e-12)
    assert (np.diff(joined.time) > 0).all() and not np.isnan(joined.q).any()
    np.testing.assert_array_equal(joined.q.sel(time=1.0, method="nearest"), second.run.q[0])
    assert joined.phase.values.tolist() == ["a"] * 25 + ["b"] * 26
    np.testing.assert_array_equal(joined.q[-1], second.q_end)


@pytest.mark.parametrize(("record", "times"), [(7, [0.0, 0.28, 0.56, 0.84, 1.0]), (1000, [0, 1])])
def test_of_every_nth_step_the_record_ends_before_the_mission(record, times):
    story = tell(SCENE, Phase("a", go(0.5, 0.5)), Phase("b", go(1.0, -0.5), 0.2), record=record)
    np.testing.assert_allclose(story.run.time, times, atol=1e-12)
    assert np.isfinite(story.run.q).all() and len(build_recording(story).arrays["time"]) == len(
        times
    )


def test_a_thing_is_carried_from_one_phase_to_another_and_never_jumps():
    phases = [
        Phase("reach", go(0.5, 0.5)),
        Phase("carry", go(1.0, -0.5), attach={"cup": "planar_2r.fore"}),
        Phase("leave", go(0.2, 0.2), release=["cup"]),
    ]
    story = tell(SCENE, *phases)
    places = []
    for leg in story.legs:
        q = leg.run.q.dropna("time").values
        places.append(leg.scene.pose("cup", q).matrix)
    start, carried, left = places
    assert (start == start[0]).all() and (left == left[0]).all()
    np.testing.assert_allclose(carried[0], start[-1], atol=1e-15)
    np.testing.assert_allclose(left[0], carried[-1], atol=1e-15)
    hand = ARM.fk(story.legs[1].run.q.dropna("time").values)
    held = np.linalg.inv(hand) @ carried
    np.testing.assert_allclose(held, np.broadcast_to(held[0], held.shape), atol=1e-14)
    assert np.abs(carried[-1] - carried[0]).max() > 0.3


def test_the_first_phase_that_goes_wrong_is_the_last():
    phases = [Phase("a", go(0.5, 0.5)), Phase("too short", go(1.0, 1.0), 0.4), Phase("c", go(0, 0))]
    story = tell(SCENE, *phases)
    assert [leg.outcome for leg in story.legs] == [Outcome.CONVERGED, Outcome.TIME_LIMIT]
    assert not story.succeeded and not story.run.attrs["succeeded"]
    assert str(story).splitlines() == [
        "    0.00 to 1.00 s  a          converged",
        "    1.00 to 1.40 s  too short  time limit",
        "phases not begun: 1",
    ]


def test_a_phase_may_expect_another_end():
    phases = [Phase("a", go(1.0, 1.0), 0.4, expects=Outcome.TIME_LIMIT), Phase("b", go(0, 0))]
    assert tell(SCENE, *phases).succeeded


def test_an_error_in_a_later_leg_ends_a_mission_and_loses_nothing():
    """The second phase carries the cup away, so that the third looks for it at the wrong place."""
    lens = rs.Camera([[500, 0, 320], [0, 500, 240], [0, 0, 1]], size=(640, 480))
    eye = rs.MountedCamera("eye", lens, on="planar_2r.fore", pose=rs.Pose.at(0, 0, -2))
    near = rs.Object("cup", marks=[[0, 0, 0.05], [0.1, 0, 0.05]], pose=rs.Pose.at(1.4, 0.9, 0))
    servo = rs.IBVS(goal=[0.6, 0.5])
    phases = [
        Phase("reach", go(0.5, 0.5)),
        Phase("carry", go(-2.0, 0.5), attach={"cup": "planar_2r.upper"}),
        Phase("look", servo, release=["cup"]),
    ]
    story = tell(rs.Scene(ARM, near, eye), *phases)
    assert [leg.name for leg in story.legs] == ["reach", "carry"] and not story.succeeded
    assert story.problem.startswith("phase 'look': ")
    assert str(story).splitlines()[-2:] == [story.problem, "phases not begun: 1"]


def test_after_an_expected_joint_limit_a_mission_goes_on_from_there():
    belt, other = rs.robots.conveyor(), rs.robots.conveyor().named("other")
    scene = rs.Scene([belt, other], motions=rs.Motion("other", [3.0]))
    there, back = (rs.FollowJoints({"conveyor.belt": x}, duration=1.0) for x in (1.9, 0.0))
    story = tell(
        scene,
        Phase("wait for the limit", there, 2.0, expects="joint_limit"),
        Phase("back", back, 0.1),
    )
    assert story.legs[0].outcome == Outcome.JOINT_LIMIT and story.legs[0].succeeded
    assert story.legs[0].q_end[1] > 2.0 and story.legs[1].run.q0[1] == 2.0


def test_each_phase_has_noise_of_its_own_and_a_mission_repeats():
    arm = rs.robots.planar_2r().named("arm")
    lens = rs.Camera([[500, 0, 320], [0, 500, 240], [0, 0, 1]])
    eye = rs.MountedCamera("eye", lens, on="arm.fore", pose=rs.Pose.at(0, 0, -2))
    scene = rs.Scene(arm, rs.Object("dots", marks=[[1.5, 0.5, 0], [1.4, 0.8, 0]]), eye)
    servo = rs.IBVS(goal=[0.3, 0.2], tolerance=1e-12)
    hold = {"duration": 0.2, "expects": Outcome.TIME_LIMIT}
    mission = Mission([Phase("a", servo, **hold), Phase("b", servo, **hold)])
    noisy = rs.Sensing(noise=0.5)
    experiment = Experiment(scene, mission, [0.25, 0.25], seed=7, sensing=noisy)
    one, two = (experiment.run() for _ in range(2))
    assert one.run.identical(two.run)
    noise = [leg.run.s.values[0] for leg in one.legs]
    assert np.abs(noise[0] - noise[1]).max() > 1e-4


def test_a_phase_may_go_by_a_change_from_wherever_it_starts():
    story = tell(
        SCENE,
        Phase("there", go(0.5, 0.5)),
        Phase("on", FollowJoints(by={"fore": -0.2}, speed=0.5, acceleration=1.0)),
        Phase("and on", by(0.1, -0.2)),
    )
    assert story.succeeded
    np.testing.assert_allclose(story.legs[1].q_end, [0.5, 0.3], atol=1e-12)
    np.testing.assert_allclose(story.legs[2].q_end, [0.6, 0.1], atol=1e-12)


def test_runs_of_a_batch_go_each_from_its_own_start():
    starts = np.array([[0.0, 0.0], [1.0, 0.5], [-0.3, 0.2]])
    change = np.array([0.1, -0.2])
    batch = rs.simulate(SCENE, by(0.1, -0.2), starts)
    np.testing.assert_allclose(batch.q_end, starts + change, atol=1e-12)
    assert batch.s_goal.values.tolist() == [0.1, -0.2] and (batch.distance_to_goal < 1e-12).all()
    np.testing.assert_allclose(batch.s.values[:, 0], 0.0, atol=1e-15)
    for start, one in zip(starts, batch.q.values, strict=True):
        alone = rs.simulate(SCENE, go(*(start + change)), start)
        np.testing.assert_allclose(one[: alone.sizes["time"]], alone.q, atol=1e-14)
    assert rs.replay(batch.isel(run=slice(1, 3))).q.equals(batch.q.isel(run=slice(1, 3)))


def test_a_run_of_a_batch_that_cannot_go_so_far_ends_at_its_limit():
    batch = rs.simulate(SCENE, by(1.0, 0.0), [[0.0, 0.0], [3.0, 0.0]])
    assert batch.outcome.values.tolist() == [Outcome.CONVERGED, Outcome.JOINT_LIMIT]


def test_a_way_beyond_a_limit_ends_a_mission_before_its_phase():
    story = tell(SCENE, Phase("a", go(3.0, 0.0)), Phase("on", by(0.5, 0.0)))
    assert len(story.legs) == 1
    assert story.problem.startswith("phase 'on': joint 'upper' is to go to 3.5 rad, outside")


def test_beside_a_camera_a_change_is_from_the_start_as_well():
    arm, other = ARM.named("arm"), ARM.named("other")
    both = rs.Parallel(
        [
            FollowJoints(by={"arm.upper": 0.3}, duration=1.0),
            FollowJoints({"other.upper": 0.3}, duration=1.0),
        ]
    )
    run = rs.simulate(rs.Scene([arm, other]), both, [0.2, 0.0, 0.2, 0.0])
    np.testing.assert_allclose(run.q_end, [0.5, 0.0, 0.3, 0.0], atol=1e-12)
    with pytest.raises(InputError, match=r"joint 'arm\.upper' is to go to 3.3 rad"):
        rs.simulate(rs.Scene([arm, other]), both, [3.0, 0.0, 0.2, 0.0])


def carried():
    phases = [
        Phase("reach", go(0.5, 0.5), 5.0),
        Phase("carry", by(0.5, -1.0), attach={"cup": "planar_2r.fore"}),
        Phase("leave", by(-0.2, 0.0), release="cup", expects=["converged", "joint_limit"]),
    ]
    return Experiment(SCENE, Mission(phases), [0.1, 0.2], dt=0.02, duration=4.0)


def test_a_mission_is_an_experiment_with_a_text():
    made = carried()
    again = Experiment.from_text(made.text)
    assert again == made and again.to_toml() == made.text and again.hash == made.hash
    assert again.task.phases[2].expects == (Outcome.CONVERGED, Outcome.JOINT_LIMIT)
    assert again.run().run.q.equals(made.run().run.q)


def test_a_mission_and_each_of_its_legs_can_be_repeated():
    made = carried()
    story = made.run()
    assert Experiment.of(story) == made and Experiment.of(story.run) == made
    for leg in story.legs:
        assert rs.replay(leg.run).identical(leg.run)
    for ask in (rs.replay, rs.explain):
        with pytest.raises(InputError, match="the run of a leg"):
            ask(story.run)


def test_phases_are_changed_by_their_names():
    made = carried()
    assert made.at("task.phases.carry.duration", "1500 ms").task.phases[1].duration == 1.5
    told = Experiment.from_text(made.text, set=["task.phases.leave.expects=time_limit"])
    assert told.task.phases[2].expects == (Outcome.TIME_LIMIT,)
    other = made.at("task.phases.reach.task", by(0.1, 0.1))
    assert other.run().legs[0].q_end == pytest.approx([0.2, 0.3])


def test_duration_and_hold_of_the_experiment_agree_with_each_phase():
    story = tell(
        SCENE, Phase("a", go(0.5, 0.5)), Phase("b", go(1, 1), 2.0), duration=1.5, hold=True
    )
    assert [leg.end - leg.start for leg in story.legs] == [pytest.approx(1.52), pytest.approx(2.0)]


def test_of_summaries_there_is_nothing_to_join():
    story = tell(SCENE, Phase("a", go(0.5, 0.5)), record="summary")
    assert story.succeeded
    with pytest.raises(InputError, match="nothing to join"):
        _ = story.run


def test_progress_covers_the_whole_mission():
    shares = []
    phases = [Phase("a", go(0.5, 0.5)), Phase("b", go(1.0, 1.0))]
    Experiment(SCENE, Mission(phases)).run(shares.append)
    assert shares == sorted(shares) and all(0 <= share <= 1 for share in shares)


@pytest.mark.parametrize(
    ("make", "told"),
    [
        (lambda: Mission([]), "Mission.phases must have at least 1 item, not 0, got"),
        (lambda: Mission([go(0, 0)]), "Mission.phases: expected a Phase, got"),
        (lambda: Mission([Phase("a", go(0, 0))] * 2), "two phases are called 'a'"),
        (lambda: Phase("", go(0, 0)), "must be a name without dots"),
        (lambda: Phase("a.b", go(0, 0)), "phase 'a.b': Phase.name must be a name without dots"),
        (lambda: Phase("a", "go"), "phase 'a': Phase.task: no task 'go'"),
        (lambda: Phase("a", Mission(Phase("b", go(0, 0)))), "cannot be part of another task"),
        (
            lambda: rs.Parallel([Mission(Phase("b", go(0, 0))), go(0, 0)]),
            "cannot be part of another task",
        ),
        (lambda: Phase("a", go(0, 0), -1.0), "phase 'a': Phase.duration must be a positive"),
        (lambda: Phase("a", go(0, 0), expects="CONVERGED"), "no outcome 'CONVERGED'"),
        (lambda: Phase("a", go(0, 0), expects="convergd"), "did you mean 'converged'"),
        (lambda: FollowJoints(by=[1], to=[1], duration=1), "give one of to=.*; got to and by"),
        (lambda: FollowJoints(by={"a": 1}, joints="a", duration=1), "by names its joints"),
        (lambda: rs.simulate(SCENE, by(0.1)), "by: expected 2 axes, for upper, fore"),
        (lambda: rs.simulate(SCENE, Mission(Phase("a", go(0, 0)))), "task: expected a task"),
        (lambda: Phase("a", go(0, 0), attach={"cup": "b"}, release="cup"), "'cup' at once"),
        (lambda: Phase("a", go(0, 0), release=5), "phase 'a': Phase.release must be a text, of"),
        (lambda: Phase("a", go(0, 0), attach=["cup"]), r"Phase.attach must be \{ object = "),
        (
            lambda: tell(SCENE, Phase("a", go(0, 0), release=["cap"])),
            "phase 'a': no object 'cap' in the scene; did you mean 'cup'",
        ),
        (
            lambda: tell(SCENE, Phase("a", go(0, 0), attach={"cup": "planar_2r.for"})),
            "phase 'a': no frame 'planar_2r.for'; did you mean 'planar_2r.fore'",
        ),
        (lambda: tell(SCENE, Phase("a", go(0, 0, 0))), "phase 'a': to: expected 2 axes"),
        (lambda: tell(SCENE, Phase("a", go(0, 0)), start=[[0, 0]]), "starts at one q0"),
    ],
)
def test_a_mission_that_cannot_be_is_refused_before_it_begins(make, told):
    with pytest.raises(InputError, match=told):
        make()
