"""Endings of an experiment: a region, a distance, and one of a user's own."""

import numpy as np
import pytest

import robsim as rs
from robsim import examples

LOW, HIGH = (-0.1, -0.1, -1.1), (0.1, 0.1, 2.0)


@pytest.fixture
def experiment():
    return rs.load_scenario(examples.path("visp_tutorial"))


def box(frame="camera", low=LOW, high=HIGH, **more):
    return rs.endings.Region(frame, low, high, **more)


def within(position):
    return ((position >= LOW) & (position <= HIGH)).all(axis=-1)


def test_a_run_ends_at_the_first_instant_in_a_region(experiment):
    whole = experiment.run()
    first = int(np.argmax(within(whole.camera_pose.values[:, :3, 3])))
    run = experiment.run(endings=[box()])
    assert rs.Outcome(int(run.outcome)) is rs.Outcome.ENDED
    assert float(run.end_time) == pytest.approx(first * experiment.dt) and first > 10
    np.testing.assert_array_equal(run.q_end.values, whole.q.values[first])
    assert int(run.ending) == 0 and run.ending.attrs["flag_meanings"] == "none Region"


def test_or_at_the_first_outside_of_it(experiment):
    start = experiment.scene.pose("camera", experiment.start).position
    run = experiment.run(endings=[box(low=start - 0.05, high=start + 0.05, leaves=True)])
    last = experiment.scene.pose("camera", run.q_end.values).position
    before = experiment.scene.pose("camera", run.q.values[int(run.end_time / experiment.dt) - 1])
    assert np.abs(last - start).max() > 0.05 >= np.abs(before.position - start).max()


def test_frames_that_come_too_close(experiment):
    target = experiment.scene.object().name
    run = experiment.run(endings=[rs.endings.TooClose("camera", target, 0.9)])
    apart = np.linalg.norm(run.camera_pose.values[:, :3, 3], axis=1)
    steps = round(float(run.end_time) / experiment.dt)
    there = experiment.scene.pose("camera", run.q_end.values).position
    away = there - experiment.scene.pose(target, run.q_end.values).position
    assert np.linalg.norm(away) < 0.9 and rs.Outcome(int(run.outcome)) is rs.Outcome.ENDED
    assert steps > 0 and np.isfinite(apart[:steps]).all()


class Slow:
    """The ending that the camera hardly moves, of whatever reason."""

    def holds(self, now):
        return (np.abs(now.qd).max(axis=1) < 0.05) & (now.time > 0.1)


def test_one_of_a_users_own_sees_each_run_of_a_batch(experiment):
    starts = np.stack([experiment.start] * 5)
    starts[:, 0] += np.linspace(0, 0.1, 5)
    runs = experiment.with_(start=starts, endings=[box(), Slow()]).run()
    ended = runs.outcome.values == rs.Outcome.ENDED
    assert ended.sum() >= 3 and set(runs.ending.values[ended]) <= {0, 1}
    assert (runs.ending.values[~ended] == -1).all()
    for i, start in enumerate(starts):
        own = experiment.with_(start=start, endings=[box(), Slow()], first_run=i).run()
        np.testing.assert_array_equal(own.q_end.values, runs.q_end.values[i])
        assert int(own.ending) == int(runs.ending[i])


def test_the_built_in_endings_come_first(experiment):
    class Now:
        def holds(self, now):
            return np.ones(len(now.q), dtype=bool)

    blind = experiment.with_(start=experiment.scene.home, endings=[Now()])
    assert rs.Outcome(int(blind.run().outcome)) is not rs.Outcome.RUNNING
    late = experiment.with_(endings=[Now()]).run()
    assert rs.Outcome(int(late.outcome)) is rs.Outcome.ENDED and float(late.end_time) == 0.0


def test_a_text_holds_endings_and_a_run_is_explained_by_them(experiment):
    made = experiment.with_(endings=[box(), rs.endings.TooClose("camera", "world", 0.2)])
    assert rs.Experiment.from_text(made.to_toml()) == made
    run = made.run()
    assert rs.Experiment.of(run) == made
    assert "Region" in rs.explain(run).what


def test_numbers_that_differ_from_run_to_run_agree_with_the_frames(experiment):
    """The camera of each run has its own mount, and so its own way into the region."""
    name = f"cameras.{experiment.scene.cameras[0].name}.position"
    made = experiment.with_(endings=[box()]).vary({name: [[0, 0, 0], [0.02, 0, 0], [0, 0.03, 0]]})
    runs = made.run(record="summary")
    ends = [float(made.of_run(i).run(record="summary").end_time) for i in range(3)]
    np.testing.assert_array_equal(runs.end_time.values, ends)
    assert len(set(ends)) > 1


class Shape:
    def holds(self, now):
        return [True]


class Kind:
    def holds(self, now):
        return np.ones(len(now.q))


@pytest.mark.parametrize(
    ("endings", "message"),
    [
        ([rs.endings.Region("hand", LOW, HIGH)], "Region: no frame 'hand'"),
        ([rs.endings.TooClose("camera", "hand", 0.1)], "TooClose: no frame 'hand'"),
        (["region"], "endings"),
        (3, "endings"),
        (Kind(), r"Kind.holds: expected truth values of shape \(1,\)"),
        (lambda now: True, "endings"),
    ],
)
def test_an_invalid_ending_is_refused(experiment, endings, message):
    with pytest.raises(rs.errors.InputError, match=message):
        experiment.run(endings=endings)


def test_a_region_without_room_is_refused():
    with pytest.raises(rs.errors.InputError, match="low must be below high"):
        rs.endings.Region("camera", (0, 0, 0), (1, 0, 1))
    with pytest.raises(rs.errors.InputError, match="distance"):
        rs.endings.TooClose("camera", "world", 0.0)
