"""Missions: legs that begin where the last one ended, things that change hands, and their ends."""

import numpy as np
import pytest

import robsim as rs
from robsim import FollowJoints, InputError, Mission, Outcome, Phase

ARM = rs.robots.planar_2r()
CUP = rs.Object("cup", rs.Block(0.1, 0.1, 0.1), marks=[[0, 0, 0.05]], pose=rs.Pose.at(1.2, 0.9, 0))
SCENE = rs.Scene(ARM, CUP)


def go(*to, **more):
    return FollowJoints(to=to, duration=1.0, **more)


def test_each_leg_starts_where_the_last_one_ended_and_time_goes_on():
    story = Mission(SCENE, [Phase("a", go(0.5, 0.5)), Phase("b", go(1.0, -0.5))]).run()
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


def test_a_thing_is_carried_from_one_phase_to_another_and_never_jumps():
    phases = [
        Phase("reach", go(0.5, 0.5)),
        Phase("carry", go(1.0, -0.5), attach={"cup": "planar_2r.fore"}),
        Phase("leave", go(0.2, 0.2), release=["cup"]),
    ]
    story = Mission(SCENE, phases).run()
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
    story = Mission(SCENE, phases).run()
    assert [leg.outcome for leg in story.legs] == [Outcome.CONVERGED, Outcome.TIME_LIMIT]
    assert not story.succeeded and not story.run.attrs["succeeded"]
    assert str(story).splitlines() == [
        "    0.00 s  a          converged",
        "    1.00 s  too short  time limit",
        "phases not begun: 1",
    ]


def test_a_phase_may_expect_another_end():
    phases = [Phase("a", go(1.0, 1.0), 0.4, expects=Outcome.TIME_LIMIT), Phase("b", go(0, 0))]
    assert Mission(SCENE, phases).run().succeeded


def test_what_turns_out_on_the_way_ends_a_mission_and_loses_nothing():
    """The second phase carries the cup away, so that the third looks for it where it is not."""
    lens = rs.Camera([[500, 0, 320], [0, 500, 240], [0, 0, 1]], size=(640, 480))
    eye = rs.MountedCamera("eye", lens, on="planar_2r.fore", pose=rs.Pose.at(0, 0, -2))
    near = rs.Object("cup", marks=[[0, 0, 0.05], [0.1, 0, 0.05]], pose=rs.Pose.at(1.4, 0.9, 0))
    servo = rs.IBVS(goal=[0.6, 0.5])
    phases = [
        Phase("reach", go(0.5, 0.5)),
        Phase("carry", go(-2.0, 0.5), attach={"cup": "planar_2r.upper"}),
        Phase("look", servo, release=["cup"]),
    ]
    story = Mission(rs.Scene(ARM, near, eye), phases).run()
    assert [leg.name for leg in story.legs] == ["reach", "carry"] and not story.succeeded
    assert story.problem.startswith("phase 'look': ")
    assert str(story).splitlines()[-2:] == [story.problem, "phases not begun: 1"]


def test_after_an_expected_joint_limit_a_mission_goes_on_from_there():
    belt, other = rs.robots.conveyor(), rs.robots.conveyor().named("other")
    scene = rs.Scene([belt, other], motions=rs.Motion("other", [3.0]))
    there, back = (rs.FollowJoints({"conveyor.belt": x}, duration=1.0) for x in (1.9, 0.0))
    story = Mission(
        scene,
        [
            Phase("wait for the limit", there, 2.0, expects=Outcome.JOINT_LIMIT),
            Phase("back", back, 0.1),
        ],
    ).run()
    assert story.legs[0].outcome == Outcome.JOINT_LIMIT and story.legs[0].succeeded
    assert story.legs[0].q_end[1] > 2.0 and story.legs[1].run.q0[1] == 2.0


def test_each_phase_has_noise_of_its_own_and_a_mission_repeats():
    arm = rs.robots.planar_2r().named("arm")
    lens = rs.Camera([[500, 0, 320], [0, 500, 240], [0, 0, 1]])
    eye = rs.MountedCamera("eye", lens, on="arm.fore", pose=rs.Pose.at(0, 0, -2))
    scene = rs.Scene(arm, rs.Object("dots", marks=[[1.5, 0.5, 0], [1.4, 0.8, 0]]), eye)
    servo = rs.IBVS(goal=[0.3, 0.2], tolerance=1e-12)
    hold = {"duration": 0.2, "expects": Outcome.TIME_LIMIT}
    mission = Mission(scene, [Phase("a", servo, **hold), Phase("b", servo, **hold)])
    noisy = rs.Sensing(noise=0.5)
    one, two = (mission.run([0.25, 0.25], seed=7, sensing=noisy) for _ in range(2))
    assert one.run.identical(two.run)
    noise = [leg.run.s.values[0] for leg in one.legs]
    assert np.abs(noise[0] - noise[1]).max() > 1e-4


@pytest.mark.parametrize(
    ("make", "told"),
    [
        (lambda: Mission(SCENE, []), "needs a list of Phase"),
        (lambda: Mission(SCENE, [go(0, 0)]), "needs a list of Phase"),
        (lambda: Phase("", go(0, 0)), "a phase needs a name"),
        (lambda: Phase("a", "go"), "phase 'a': expected a task"),
        (lambda: Phase("a", go(0, 0), -1.0), "duration of phase 'a'"),
        (lambda: Phase("a", go(0, 0), expects="CONVERGED"), "expects an Outcome"),
        (lambda: Phase("a", go(0, 0), attach={"cup": "b"}, release="cup"), "'cup' at once"),
        (lambda: Phase("a", go(0, 0), release=5), "phase 'a': release is a list of objects"),
        (lambda: Phase("a", go(0, 0), attach=["cup"]), "phase 'a': attach is {object: frame}"),
        (
            lambda: Mission(SCENE, [Phase("a", go(0, 0), release=["cap"])]),
            "phase 'a': no object 'cap'; did you mean 'cup'",
        ),
        (
            lambda: Mission(SCENE, [Phase("a", go(0, 0), attach={"cup": "planar_2r.for"})]),
            "phase 'a': no frame 'planar_2r.for'; did you mean 'planar_2r.fore'",
        ),
        (lambda: Mission(SCENE, [Phase("a", go(0, 0, 0))]).run(), "phase 'a': to: expected 2 axes"),
        (lambda: Mission(SCENE, [Phase("a", go(0, 0))]).run([[0, 0]]), "starts at one q0"),
    ],
)
def test_a_mission_that_cannot_be_is_refused_before_it_begins(make, told):
    with pytest.raises(InputError, match=told):
        make()
