"""A study reports of its runs the same as each run alone."""

import numpy as np
import pytest

import robsim as rs
from robsim.statistics.proportions import estimate_share
from robsim.units import deg


@pytest.fixture(scope="module")
def found(flying, how):
    return rs.study(flying, 60, **how)


def test_a_row_equals_its_run_alone(found):
    for number in (0, 1, 2, 77, 179):
        row, run = found.table.iloc[number], found.replay(number)
        assert rs.Outcome(int(run.outcome)).name == row["outcome"]
        for name in ("end_time", "distance_to_goal", "angle_to_goal", "path_length", "pixel_error"):
            assert float(run[name]) == row[name], name
        assert float(run.error_norm.dropna("time")[-1]) == row["error_norm"]
        np.testing.assert_array_equal(
            run.camera_pose[0, :3, 3], [row["start_x"], row["start_y"], row["start_z"]]
        )


def test_the_sampled_value_is_the_value_of_the_run(found):
    row, one = found.table.iloc[100], found.of_run(100)
    assert one.task.gain == row["task.gain"]
    assert type(one.task).__name__ == row["task"]
    assert one.task.belief.camera("eye").camera.K[0, 0] == row["belief.cameras.eye.focal"]
    assert one.scene.camera("eye").camera.K[0, 0] == 500.0


def test_labels_that_are_given_to_numbers_are_in_the_table(flying):
    vary = {"task.gain": {"slow": 0.5, "fast": 2.0}}
    found, plain = rs.study(flying, 4, vary=vary), rs.study(flying, 4, vary={"task.gain": [0.5, 2]})
    assert found.table["task.gain"].tolist() == ["slow", "fast"] * 4
    assert found.of_run(1).task.gain == 2.0
    np.testing.assert_array_equal(found.table["end_time"], plain.table["end_time"])


def test_a_focal_length_times_a_sample_is_in_pixels(found):
    focal = found.table["belief.cameras.eye.focal"]
    assert abs(focal.mean() - 500) < 10 and 15 < focal.std() < 35


def test_runs_of_a_sample_share_all_but_the_values_in_turn(found):
    table = found.table
    assert (table.groupby("draw").size() == 3).all() and table["draw"].nunique() == 60
    shared = ["task.gain", "belief.cameras.eye.focal", "start_x", "start_angle", "start_tries"]
    assert (table.groupby("draw")[shared].nunique() == 1).all(axis=None)
    assert table["task"].tolist() == ["IBVS", "PBVS", "Hybrid"] * 60


def test_starts_are_those_that_see_their_target(found, flying):
    assert found.table["began"].all()
    wide = rs.starts.LookAt("square", distance=(0.2, 0.5), cone=np.pi / 2, roll=(-180, 180) * deg)
    some = rs.study(flying.with_(duration=0.04), 200, start=wide, seed=1)
    every = rs.starts.LookAt(**{**vars(wide), "visible": False})
    blind = rs.study(flying.with_(duration=0.04), 400, start=every, seed=1)
    told, counted = some.visible, blind.table["began"].mean()
    assert some.table["began"].all() and 0.02 < told.value < 0.9
    assert told.of == some.table["start_tries"].sum()
    assert abs(told.value - counted) < 0.08  # two estimates of one rate


def test_counts_are_of_those_that_began(flying):
    q = np.tile(flying.scene.home, (4, 1))
    q[1, 0] = 5.0  # far aside
    q[2:, 2] = [-0.3, 0.2]
    some = rs.study(flying, start=q)
    counts = some.counts()
    runs, began, shares = counts.rows["all"]
    assert (runs, began) == (4, 3) and shares["CONVERGED"] == estimate_share(3, 3)
    assert counts.unstarted == {"out of image": 1}
    assert "1 of 4 runs could not begin and are not counted: 1 out of image\n" in f"{some}\n"
    assert some.converged() == estimate_share(3, 3)


def test_the_noise_of_a_run_belongs_to_its_sample(flying):
    noisy = flying.at("sensing.noise", 0.5).with_(start=[0.1, 0, -0.2, 0, 0, 0, 1], duration=1.0)
    tasks = {"one": rs.IBVS(gain=2), "same": rs.IBVS(gain=2.0, depth="true")}
    twice = rs.study(noisy, 3, seed=2, vary={"task": tasks})
    error = twice.table["error_norm"].to_numpy().reshape(3, 2)
    np.testing.assert_array_equal(error[:, 0], error[:, 1])
    assert len(set(error[:, 0])) == 3
    batch = noisy.with_(seed=2, start=np.tile(noisy.start, (3, 1)), record="summary").run()
    np.testing.assert_array_equal(batch.error_norm, error[:, 0])


def test_values_that_cannot_vary_in_a_batch_are_simulated_run_by_run(flying):
    """The period, a limit and a word, which are of an experiment as a whole."""
    vary = {
        "run.dt": rs.samplers.Choice(["20 ms", 0.04]),
        "task.interaction": ["current", "desired"],
        "task.law": [rs.laws.CameraLaw(length=0.1), "joint"],
        "actuation.lag": rs.samplers.Uniform(0.0, 0.05),
    }
    some = rs.study(
        flying.with_(duration=1.0), 5, start=rs.starts.Shell(distance=(0.1, 0.2)), vary=vary
    )
    assert some.plan.runs == 20
    assert set(some.table["run.dt"]) <= {"20 ms", "0.04"}
    for number in (0, 7, 19):
        run, row = some.replay(number), some.table.iloc[number]
        assert float(run.error_norm.dropna("time")[-1]) == row["error_norm"]
        lag = some.of_run(number).actuation.lag
        assert lag == row["actuation.lag"]


def test_plus_and_times_change_the_nominal_value(flying):
    vary = {
        "cameras.eye.position": rs.samplers.Sum(rs.samplers.Normal(0.0, [0.0, 0.0, 0.01])),
        "belief.objects.square.marks": rs.samplers.Product(rs.samplers.Uniform(0.9, 1.1)),
    }
    some = rs.study(flying.with_(duration=0.2), 50, vary=vary, seed=1).table
    assert (some["cameras.eye.position[0]"] == 0).all()
    assert 0.005 < some["cameras.eye.position[2]"].std() < 0.015
    ratio = some["belief.objects.square.marks[0,0]"] / -0.1
    assert 0.9 <= ratio.min() < ratio.max() <= 1.1


def test_standard_measures_agree_with_compare(flying):
    q = [[0.1, 0.05, -0.2, 0, 0, 0.3, 0.95], [0, 0.1, 0.1, 0, 0, -0.2, 0.98]]
    starts = np.array(q) / np.r_[[1] * 3, [1] * 4]
    starts[:, 3:] /= np.linalg.norm(starts[:, 3:], axis=1, keepdims=True)
    some = rs.study(flying, start=starts, measures=True, vary={"task.gain": [1.0, 2.0]}).table
    alone = rs.compare({"one": flying.with_(start=starts, task=rs.IBVS(gain=2.0))}).data
    own = some[some["task.gain"] == 2.0]
    for name in ("retreat", "image_detour", "border_margin", "rotation", "effort_linear"):
        np.testing.assert_allclose(own[name], alone[name][0], rtol=1e-12, err_msg=name)


def test_the_worst_are_named(found):
    worst = found.worst("distance_to_goal", 3)
    top = found.table.sort_values("distance_to_goal", ascending=False)["run"].head(3)
    assert worst["run"].tolist() == top.tolist()


def test_a_changed_run_is_reported(found, monkeypatch):
    runs, facts = found._facts
    other = {**facts, "path_length": facts["path_length"] + 1.0}
    doctored = rs.studies.StudyResult(found.plan, lambda: (runs, other))
    with pytest.warns(rs.errors.ReplayWarning, match="run 4 has another path_length now"):
        doctored.replay(4)


def test_counts_are_written_as_tables(found, tmp_path):
    rows = found.counts("task").csv().splitlines()
    counts = dict(zip(rows[0].split(","), rows[1].split(","), strict=True))
    ends = ("IBVS", "PBVS", "Hybrid")
    assert [row.split(",")[0] for row in rows[1:]] == [*ends]
    known = [int(n) for name, n in counts.items() if name.endswith(" count")]
    assert sum(known) == int(counts["began"]) == 60
    assert rows[0].startswith("task,runs,began,")
    tex = found.save(tmp_path / "counts.tex").read_text()
    assert "IBVS" in tex and "IBVS & 60 & 60" in tex
    lines = found.save(tmp_path / "table.csv").read_text().splitlines()
    assert len(lines) == 181 and lines[0].startswith("run,draw,task.gain,")
    pandas = pytest.importorskip("pandas")
    again = pandas.read_parquet(found.save(tmp_path / "table.parquet"))
    assert again.equals(found.table)


@pytest.mark.parametrize("measures", [np.array([1, 2]), np.zeros(0), np.array([True]), None, "yes"])
@pytest.mark.parametrize("runs", [(), (5,)])
def test_measures_are_true_or_false(flying, measures, runs):
    with pytest.raises(rs.errors.InputError, match="measures must be True or False"):
        rs.study(flying, *runs, measures=measures)
