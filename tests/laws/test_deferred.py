"""A run becomes a Dataset when it is read, and users cannot notice it."""

import copy
import pickle
import threading
import weakref
from dataclasses import dataclass
from typing import Annotated

import numpy as np
import pytest
import xarray as xr

import robsim as rs
from robsim.base.value import is_immutable
from robsim.declare import DeclaredValue, Number
from robsim.engine.chunk import ChunkProgress
from robsim.files.lazy_dataset import LazyDataset

TUTORIAL = rs.load_scenario(rs.examples.path("visp_tutorial")).with_(duration=0.4)
PARTS = ("_variables", "_coord_names", "_dims", "_indexes", "_encoding", "_close")


def is_set(dataset, slot):
    try:
        object.__getattribute__(dataset, slot)
    except AttributeError:
        return False
    return True


def make_small_dataset():
    return xr.Dataset({"a": ("x", [1.0, 2.0])}, {"x": [3, 4]})


def deferred(dataset=make_small_dataset, attrs=lambda: {"title": "t"}):
    return LazyDataset.of(dataset, attrs)


WHOLE = make_small_dataset().assign_attrs(title="t")


def counting(function):
    def counted():
        counted.calls += 1
        return function()

    counted.calls = 0
    return counted


USES = {
    "identical": lambda d: d.identical(WHOLE) and WHOLE.identical(d),
    "is a Dataset": lambda d: isinstance(d, xr.Dataset) and d.a.dims == ("x",),
    "names": lambda d: list(d) == ["a"] and "a" in d and len(d) == 1 and list(d.coords) == ["x"],
    "attrs": lambda d: d.attrs == {"title": "t"} and d.title == "t",
    "repr": lambda d: repr(d).split("\n", 1)[1] == repr(WHOLE).split("\n", 1)[1],
    "html": lambda d: "title" in d._repr_html_(),
    "dir": lambda d: {"a", "x", "title"} <= set(dir(d)),
    "copy": lambda d: copy.copy(d).identical(WHOLE),
    "deepcopy": lambda d: copy.deepcopy(d).identical(WHOLE),
    "pickle": lambda d: all(
        pickle.loads(pickle.dumps(d, n)).identical(WHOLE)
        for n in range(2, pickle.HIGHEST_PROTOCOL + 1)
    ),
    "arithmetic": lambda d: (2.0 * d - d).equals(WHOLE) and bool((d == WHOLE).a.all()),
    "reduction": lambda d: float(d.mean().a) == 1.5,
    "selection": lambda d: d.sel(x=4).identical(WHOLE.sel(x=4)) and float(d.isel(x=0).a) == 1.0,
    "concat": lambda d: xr.concat([d, WHOLE], "x").identical(xr.concat([WHOLE, WHOLE], "x")),
    "merge": lambda d: xr.merge([d, {"c": 1.0}]).equals(WHOLE.assign(c=1.0)),
    "mapping": lambda d: dict(d)["a"].identical(WHOLE.a) and d.get("b") is None,
    "weak reference": lambda d: weakref.ref(d)() is d and d.sizes == {"x": 2},
    "a missing name": lambda d: not hasattr(d, "b") and not hasattr(d, "_other"),
    "an assigned variable": lambda d: float(d.assign(b=1.0).b) == 1.0 and "b" not in d,
}  # fmt: skip


@pytest.mark.parametrize("use", USES)
def test_it_is_a_dataset_in_every_use(use):
    assert USES[use](deferred())


def test_a_variable_can_be_set_and_deleted():
    dataset = deferred()
    dataset["b"] = ("x", [5.0, 6.0])
    del dataset["a"]
    assert list(dataset) == ["b"] and dataset.attrs == {"title": "t"}


def test_each_half_is_made_once_and_only_when_it_is_read():
    variables, attrs = counting(make_small_dataset), counting(lambda: {"title": "t"})
    dataset = deferred(variables, attrs)
    assert not any(is_set(dataset, slot) for slot in (*PARTS, "_attrs"))
    assert float(dataset.a[1]) == 2.0 and float(dataset["a"][0]) == 1.0
    assert (variables.calls, attrs.calls) == (1, 0) and not is_set(dataset, "_attrs")
    assert dataset.attrs == dataset.copy().attrs == {"title": "t"}
    assert (variables.calls, attrs.calls) == (1, 1) and dataset._makers == {}


def test_assigned_attributes_are_not_made_again():
    attrs = counting(dict)
    dataset = deferred(attrs=attrs)
    dataset.attrs = {"own": 1}
    assert dataset.identical(make_small_dataset().assign_attrs(own=1)) and attrs.calls == 0


def test_an_accessor_of_xarray_keeps_its_object():
    @xr.register_dataset_accessor("_of_this_test")
    class Accessor:
        def __init__(self, dataset):
            self.total = float(dataset.a.sum())

    dataset = deferred()
    try:
        assert dataset._of_this_test is dataset._of_this_test
        assert dataset._of_this_test.total == 3.0
    finally:
        del xr.Dataset._of_this_test


@pytest.mark.parametrize("error", [AttributeError("no b"), KeyError("b"), IndexError("b")])
@pytest.mark.parametrize("read", [lambda d: d.a, lambda d: d.get("a"), lambda d: hasattr(d, "a")])
def test_an_error_on_the_way_is_no_missing_name(error, read):
    def broken():
        raise error

    with pytest.raises(RuntimeError, match=r"could not be made: .*b") as caught:
        read(deferred(broken))
    assert caught.value.__cause__ is error
    with pytest.raises(RuntimeError, match="could not be made"):
        _ = deferred(attrs=broken).attrs


def test_after_an_interruption_it_is_made_anew():
    def first_time():
        if attempts.calls == 1:
            raise KeyboardInterrupt
        return make_small_dataset()

    attempts = counting(first_time)
    dataset = deferred(attempts)
    with pytest.raises(KeyboardInterrupt):
        _ = dataset.a
    assert dataset.identical(WHOLE) and attempts.calls == 2


def test_threads_that_read_at_once_read_the_same_object():
    begin = threading.Barrier(8)
    variables = counting(make_small_dataset)
    dataset, seen = deferred(variables), []

    def read():
        begin.wait()
        seen.append(dataset.variables["a"])

    threads = [threading.Thread(target=read) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert variables.calls == 1 and all(one is seen[0] for one in seen) and len(seen) == 8


# ---- runs ----


def test_a_run_holds_no_dataset_until_it_is_read_and_its_text_until_that_is_requested():
    run = TUTORIAL.run()
    assert not any(is_set(run, slot) for slot in (*PARTS, "_attrs"))
    assert rs.Outcome(int(run.outcome)) is rs.Outcome.TIME_LIMIT and not is_set(run, "_attrs")
    assert run.attrs["scenario"] == TUTORIAL.to_toml(complete=True) and rs.replay(run).identical(
        run
    )


CASES = {
    "one run": TUTORIAL,
    "a summary": TUTORIAL.with_(record="summary"),
    "a batch": TUTORIAL.with_(start=np.stack([TUTORIAL.start] * 3)),
    "lag": TUTORIAL.with_(actuation=rs.Actuation(lag=0.1)),
    "numbers that differ": TUTORIAL.vary({"task.gain": [0.5, 1.0]}),
}


@pytest.mark.parametrize("case", CASES)
def test_a_variable_that_is_read_alone_equals_that_of_the_whole_run(case):
    experiment = CASES[case]
    whole = experiment.run().load()
    for read in (lambda run, name: run[name], lambda run, name: getattr(run, name, run[name])):
        for name in whole.data_vars:
            run = experiment.run()
            alone = read(run, name)
            assert alone.identical(whole[name]) and not is_set(run, "_variables")
            assert list(alone.coords) == list(whole[name].coords)
            assert list(alone.indexes) == list(whole[name].indexes)


def test_a_variable_that_was_read_alone_is_that_of_the_run():
    run = TUTORIAL.run()
    q, outcome = run.q, run["outcome"]
    q.values[0, 0], outcome.attrs["own"] = 7.0, "note"
    run.q.coordinate.attrs["own"] = "name"
    assert not is_set(run, "_variables") and run.q.values[0, 0] == 7.0
    assert run.copy().q.values[0, 0] == 7.0 and run.q.variable is q.variable
    assert run.outcome.attrs["own"] == "note" and run.coordinate.attrs == {"own": "name"}
    assert TUTORIAL.run().load().coordinate.attrs == {}
    assert not hasattr(TUTORIAL.run(), "no_such_name") and "no_such_name" not in TUTORIAL.run()


def test_a_run_that_was_read_keeps_nothing_of_the_loop():
    from robsim.run.simulation_dataset import make_dataset

    loop = TUTORIAL.loop()
    loop.advance(ChunkProgress(np.arange(1)), lambda share: None)
    run, gone = make_dataset(loop, TUTORIAL), weakref.ref(loop)
    del loop
    assert gone() is not None and run.sizes["time"] == 11
    assert gone() is None


def test_a_late_read_equals_an_early_read(tmp_path):
    starts = np.stack([TUTORIAL.start, TUTORIAL.start + 0.01 * np.eye(7)[0]])
    early, late = (TUTORIAL.with_(start=starts).run(threads=n) for n in (1, 2))
    early.load()
    TUTORIAL.with_(seed=3).run()
    assert late.identical(early)
    again = pickle.loads(pickle.dumps(TUTORIAL.run()))
    assert type(again) is type(late) and again.identical(TUTORIAL.run())
    assert rs.open_run(rs.save_run(TUTORIAL.run(), tmp_path / "run.nc")).identical(again)


@dataclass
class Changing(DeclaredValue):
    """A law of a user that is registered, but not frozen."""

    share: Annotated[float, Number(above=0), "Share of the usual command."] = 1.0

    def command(self, state):
        return -self.share * 0.1 * state.error[:, :6]


def test_a_run_names_a_law_that_has_changed_since(monkeypatch):
    from robsim.declare.kind_families import family, register

    monkeypatch.setattr(family("law"), "loaded", dict(family("law").loaded))
    law = register("law", "changing")(Changing)(0.5)
    experiment = TUTORIAL.with_(task=rs.IBVS(goal=TUTORIAL.task.goal, law=law))
    run = experiment.run()
    law.share = 0.25
    assert "share = 0.5" in run.attrs["scenario"] and run.attrs["law"] == "Changing(share=0.5)"
    slower = experiment.run()
    assert (slower.qd[0] == 0.5 * run.qd[0]).all() and (run.qd[0] != 0.0).any()


def test_a_changed_object_of_a_user_is_bound_anew():
    class Scaled:
        unit, tolerance, factor = "1", 1e-5, 1.0

        def measure(self, seen):
            return self.factor * seen.points.reshape(len(seen.points), -1)

    feature = Scaled()
    task = rs.IBVS(goal=TUTORIAL.task.goal, features=feature)
    before = task.bind(TUTORIAL.scene).s_goal
    feature.factor = 2.0
    np.testing.assert_array_equal(task.bind(TUTORIAL.scene).s_goal, 2.0 * before)


def test_a_task_of_ours_is_bound_once_to_a_scene_and_anew_to_another():
    task, scene = TUTORIAL.task, TUTORIAL.scene
    once = task.bind(scene)
    assert task.bind(scene) is once
    other = scene.replacing(scene.objects[0])
    assert task.bind(other).scene is other and task.bind(scene) is not once
    assert "_last_controller" not in vars(copy.copy(task)) and "_last_controller" not in vars(
        pickle.loads(pickle.dumps(task))
    )


def test_a_kept_controller_warns_each_time():
    task = rs.IBVS(
        goal=TUTORIAL.task.goal, features=rs.features.FeatureBlock("points", marks=[0, 1])
    )
    for _ in range(2):
        with pytest.warns(rs.errors.RankWarning, match="fix only 4 of the 6"):
            task.bind(TUTORIAL.scene)


@pytest.mark.parametrize(
    ("value", "stays"),
    [
        (rs.IBVS(goal=rs.GoalPose(rs.Pose.at(0, 0, 1))), True),
        (rs.PBVS(goal=[0.1, 0.2]), True),
        (rs.IBVS(goal={"arm": [0.1]}), False),
        (rs.IBVS(law=type("Own", (), {"command": print})()), False),
        (rs.Sensing(noise=0.5, latency=0.1), True),
        (np.zeros(3), False),
    ],
)
def test_only_our_own_values_are_taken_as_constant(value, stays):
    assert is_immutable(value) is stays


def test_the_joints_of_a_goal_cannot_change():
    task = rs.FollowJoints({"link1": 0.5}, duration=2.0)
    for change in (
        lambda to: to.update(link1=0.7),
        lambda to: to.__setitem__("link1", 0.7),
        lambda to: to.pop("link1"),
        lambda to: to.clear(),
    ):
        with pytest.raises(TypeError, match="read-only"):
            change(task.to)
    for again in (copy.copy(task), copy.deepcopy(task), pickle.loads(pickle.dumps(task))):
        assert again == task and again.to == {"link1": 0.5} and is_immutable(again)
    assert is_immutable(task)


def test_a_leg_of_a_mission_makes_no_text_until_it_is_read(monkeypatch):
    texts = []
    write = rs.Experiment.to_toml
    monkeypatch.setattr(
        rs.Experiment, "to_toml", lambda of, **how: texts.append(of) or write(of, **how)
    )
    legs = rs.load_scenario(rs.examples.path("inspection_a")).run().legs
    before = len(texts)
    assert before <= 1
    assert "[task]" in legs[1].run.attrs["scenario"] and len(texts) == before + 1
