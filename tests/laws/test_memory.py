"""The memory of a controller belongs to its run: the bits depend on neither chunks nor threads."""

from dataclasses import dataclass

import numpy as np
import pytest

import robsim as rs

P = rs.features.FeatureBlock
quiet = pytest.mark.filterwarnings("ignore::robsim.errors.RankWarning")
RUNS = 7


@dataclass(frozen=True)
class Eager:
    """A user's law that remembers: the joint law, pushed by the sum of its own past commands."""

    push: float = 0.3

    def command(self, state):
        kept = state.memory
        plain = rs.laws.JointLaw().command(state)
        past = kept.get("past", np.zeros(plain.shape))
        kept["past"] = past + state.dt * plain
        kept.setdefault("calls", np.zeros(len(plain), dtype=np.int64))
        kept["calls"] = kept["calls"] + 1
        kept.setdefault("deep", {})["last"] = plain.copy()
        return plain + self.push * past


TASKS = {
    "plain": rs.IBVS(),
    "broyden": rs.IBVS(interaction="broyden"),
    "depth filter": rs.IBVS(depth=rs.laws.DepthFilter(0.6)),
    "smooth start": rs.PBVS(smooth_start=3.0),
    "secondary": rs.PBVS(secondary=rs.laws.AvoidLimits(margin=0.45), projection="large"),
    "own law": rs.IBVS(law=Eager()),
    "latch": rs.Switch(rs.PBVS(), rs.IBVS(law=Eager()), rs.tasks.ErrorBelow(0.05)),
    "ordered": rs.Priorities(
        [
            rs.IBVS(features=[P("points", marks=[0])], depth=rs.laws.DepthFilter(0.6)),
            rs.IBVS(interaction="broyden"),
        ],
        smooth_start=5.0,
    ),
    "nested": rs.Switch(
        rs.IBVS(depth=rs.laws.DepthFilter(0.5), smooth_start=2.0),
        rs.Priorities([rs.IBVS(interaction="broyden"), rs.PBVS()]),
        rs.tasks.ErrorBelow(0.08),
    ),
}
TRACKING = {
    "estimated": rs.IBVS(feed_forward="estimated", gain=2.0),
    "estimated and filtered": rs.IBVS(
        feed_forward=rs.laws.EstimatedMotion(0.1),
        depth=rs.laws.DepthFilter(1.3),
        limit=rs.laws.SpeedLimit(joint=0.5),
    ),
}


def closed(scene, task, q0, **how):
    """Runs end at different times, so that chunks lose runs on their way."""
    given = {"dt": 0.04, "duration": 3.0, "sensing": rs.Sensing(noise=1.0), "seed": 5}
    return rs.simulate(scene, task, q0, **given | how)


def same(a, b):
    for name in ("q", "qd", "s", "pixels", "outcome", "end_time", "path_length", "q_end"):
        np.testing.assert_array_equal(a[name], b[name], err_msg=name)


def check(scene, task, q0, **how):
    whole = closed(scene, task, q0, **how)
    same(whole, closed(scene, task, q0, **how, chunk=3, threads=2))
    alone = closed(scene, task, q0[4], **how, first_run=4)
    same(whole.isel(run=4), alone)


SPOILT = {
    "perfect": {"sensing": None},
    "noise": {"sensing": rs.Sensing(noise=1.0)},
    "everything": {
        "sensing": rs.Sensing(
            0.5, 0.25, 0.05, 5.0, [rs.imperfections.Occlusion([1], 0.3, 0.6)], 0.2, 0.055, 0.08
        ),
        "actuation": rs.Actuation(0.05, 0.5, 3.0, 1e-4),
    },
}


@pytest.mark.covering(2)
@pytest.mark.parametrize("spoilt", SPOILT)
@pytest.mark.parametrize("name", ["eye_in_hand", "eye_to_hand"])
@pytest.mark.parametrize("task", TASKS)
def test_no_run_depends_on_the_others_in_its_chunk(arrange, around, task, name, spoilt):
    scene = arrange(name)
    check(scene, TASKS[task], around(scene, RUNS, spread=0.08), duration=1.5, **SPOILT[spoilt])


@quiet
@pytest.mark.parametrize("name", ["turntable", "conveyor"])
@pytest.mark.parametrize("task", TRACKING)
def test_nor_does_a_run_that_tracks(arrange, around, task, name):
    scene = arrange(name)
    check(scene, TRACKING[task], around(scene, RUNS), hold=True)


def test_nor_do_runs_of_two_tasks_side_by_side(arrange, around):
    scene = arrange("head_and_arm")
    watch = rs.IBVS(camera="watch", target="dish", interaction="broyden")
    work = rs.IBVS(camera="camera", target="plate", law=Eager(), smooth_start=4.0)
    check(scene, rs.Parallel([watch, work]), around(scene, RUNS))


def test_runs_that_end_leave_the_memory_of_the_others_alone(arrange, around):
    """Some start at the goal and are over at once, some leave their limits."""
    scene = arrange("eye_in_hand")
    q0 = around(scene, RUNS, spread=0.2)
    q0[[1, 2, 5]] = scene.home
    task = rs.IBVS(
        law=Eager(), depth=rs.laws.DepthFilter(0.6), interaction="broyden", tolerance=1e-2
    )
    whole = closed(scene, task, q0, sensing=None)
    assert len(np.unique(whole.end_time)) > 3
    check(scene, task, q0, sensing=None)


@pytest.mark.parametrize("features", ["points", "pixels"])
@pytest.mark.parametrize("law", ["joint", "camera"])
def test_a_recorded_run_is_the_summarised_one(arrange, around, features, law):
    scene = arrange("eye_in_hand")
    q0, task = around(scene, RUNS), rs.IBVS(features=features, law=law)
    for record in ("summary", 7):
        some = closed(scene, task, q0, record=record)
        whole = closed(scene, task, q0)
        for name in ("outcome", "end_time", "q_end", "path_length", "pixels_end"):
            np.testing.assert_array_equal(some[name], whole[name])


def test_a_law_may_keep_nothing_between_two_simulations(arrange, around):
    """The memory belongs to the runs: the same task again gives the same bits."""
    scene, task = arrange("eye_in_hand"), rs.IBVS(law=Eager(), interaction="broyden")
    q0 = around(scene, 3)
    same(closed(scene, task, q0), closed(scene, task, q0))


class Thrifty:
    """A user's feature and law that return one array again and again, with new numbers in it."""

    unit, tolerance = "1", 1e-5

    def __init__(self):
        self.arrays = {}

    def measure(self, seen):
        return self._again(rs.features.Points().measure(seen))

    def interaction(self, seen):
        return self._again(rs.features.Points().interaction(seen))

    def command(self, state):
        return self._again(rs.laws.JointLaw().command(state))

    def _again(self, value):
        array = self.arrays.setdefault(value.shape, np.empty(value.shape))
        array[...] = value
        return array


@pytest.mark.parametrize(
    "what",
    [{}, {"interaction": "mean"}, {"interaction": "broyden"}, {"smooth_start": 3.0}],
    ids=str,
)
def test_the_array_that_a_method_returned_may_be_used_again(arrange, around, what):
    scene = arrange("eye_in_hand")
    task = rs.IBVS(features=Thrifty(), law=Thrifty(), **what)
    q0 = around(scene)[0]  # one run; its arrays have one layout whether its axis is first or last
    same(closed(scene, task, q0), closed(scene, rs.IBVS(**what), q0))


def test_memory_without_a_row_for_each_run_is_refused(arrange, around):
    class Forgetful:
        def command(self, state):
            state.memory["once"] = 3.0
            return rs.laws.JointLaw().command(state)

    scene = arrange("eye_in_hand")
    q0 = np.stack([scene.home, around(scene)[0]])
    with pytest.raises(
        rs.errors.InputError, match=r"memory 'once': .* a row for each of 2 runs, got 3.0"
    ):
        rs.simulate(scene, rs.IBVS(law=Forgetful()), q0, threads=1)


def test_rows_of_unequal_lengths_cannot_be_remembered_either(arrange, around):
    class Ragged:
        def command(self, state):
            state.memory["rows"] = [[1.0], [1.0, 2.0]]
            return rs.laws.JointLaw().command(state)

    scene = arrange("eye_in_hand")
    q0 = np.stack([scene.home, around(scene)[0]])
    with pytest.raises(rs.errors.InputError, match=r"memory 'rows': .* a row for each of 2 runs"):
        rs.simulate(scene, rs.IBVS(law=Ragged()), q0, threads=1)
