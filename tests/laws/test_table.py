"""Runs as flat tables: a row for each instant or run, never for every combination."""

import numpy as np
import pytest

import robsim as rs


@pytest.fixture(scope="module")
def demo():
    return rs.load_scenario(rs.examples.path("chapter_6_1")).run()


@pytest.fixture(scope="module")
def batch():
    one = rs.load_scenario(rs.examples.path("camera_retreat"))
    starts = np.stack([one.start, rs.Pose.at(0, 0, -1).q, rs.Pose.at(3, 0, -1).q])
    return rs.simulate(one.scene, one.task, starts, dt=0.1, duration=3, first_run=7)


def test_a_row_is_an_instant_of_a_run_until_its_end(demo):
    table = rs.logs.to_table(demo)
    assert len(table) == round(float(demo.end_time) / 0.04) + 1
    assert list(table)[:4] == ["run", "time", "outcome", "q[shoulder]"]
    assert set(table.outcome) == {"CONVERGED"} and set(table.run) == {0}
    lived = demo.isel(time=slice(0, len(table)))
    np.testing.assert_array_equal(table["time"], lived.time)
    for name, values in {
        "q[tool]": lived.q[:, 4],
        "s[3]": lived.s[:, 3],
        "error_norm": lived.error_norm,
        "camera_pose[1,3]": lived.camera_pose[:, 1, 3],
        "camera_velocity[wx]": lived.camera_velocity[:, 3],
        "pixels[2,row]": lived.pixels[:, 2, 1],
    }.items():
        np.testing.assert_array_equal(table[name], values)
    assert not [name for name in table if name.startswith(("camera_pose[3", "s_goal", "pixels_go"))]


def test_to_dataframe_is_that_table_also_of_a_run_from_a_file(demo, tmp_path):
    """The broadcast of xarray multiplies all dimensions: 77 million rows here."""
    table = rs.logs.to_table(demo)
    assert np.prod(list(demo.sizes.values())) > 7e7
    assert demo.to_dataframe().equals(table) and table.memory_usage().sum() < 200_000
    again = rs.open_run(rs.save_run(demo, tmp_path / "run.nc"))
    assert again.identical(demo) and again.to_dataframe().equals(table)
    some = demo[["q", "error_norm"]].isel(time=slice(0, 3)).to_dataframe()
    assert some.shape == (3, 8)
    every = demo[["q"]].to_dataframe(["time", "coordinate"])  # as xarray has it
    assert len(every) == 5 * demo.sizes["time"] and list(every.index.names) == [
        "time",
        "coordinate",
    ]


def test_rows_of_a_batch_are_named_by_run(batch):
    table = rs.logs.to_table(batch)
    counts = {7: 31, 8: 1, 9: 1}  # the second starts at its goal, the third sees nothing
    assert table.groupby("run").size().to_dict() == counts
    assert table.groupby("run").outcome.first().tolist() == [
        *("TIME_LIMIT", "CONVERGED", "OUT_OF_IMAGE")
    ]
    np.testing.assert_array_equal(table["s[0]"][:31], batch.s[0, :, 0])


def test_a_row_for_each_run_has_its_start_and_its_end(batch, demo):
    table = rs.logs.to_table(batch, of="runs")
    assert table.run.tolist() == [7, 8, 9]
    for name in ("end_time", "path_length", "pixel_error", "distance_to_goal", "angle_to_goal"):
        np.testing.assert_array_equal(table[name], batch[name])
    label = batch.coordinate.values[2]
    np.testing.assert_array_equal(table[f"q_end[{label}]"], batch.q_end[:, 2])
    assert len(rs.logs.to_table(demo, of="runs")) == 1 and "time" not in rs.logs.to_table(
        demo, of="runs"
    )


def test_of_a_summary_there_are_rows_of_runs_alone(free_scene):
    marks = [[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0.1, 0.1, 0]]
    task = rs.IBVS(rs.Pose.at(0, 0, -1))
    run = rs.simulate(free_scene(marks), task, rs.Pose.at(0, 0, -1.2), record="summary")
    table = rs.logs.to_table(run)
    assert len(table) == 1 and float(table["s[0]"][0]) == float(run.s[0])
    with pytest.raises(rs.errors.InputError, match="only the end of this run was recorded"):
        rs.logs.to_table(run, of="steps")


def test_every_column_has_a_unit(demo):
    mixed = rs.load_scenario(rs.examples.path("mobile_arm")).run(duration=0.2)
    for run in (demo, mixed):
        for of in ("steps", "runs"):
            table = rs.logs.to_table(run, of=of)
            assert set(table.attrs["units"]) == set(table)
    units = rs.logs.to_table(demo).attrs["units"]
    assert (units["time"], units["q[tool]"], units["s[0]"]) == ("s", "rad", "px")
    assert (units["camera_velocity[vz]"], units["camera_velocity[wz]"]) == ("m/s", "rad/s")
    assert (units["camera_pose[0,0]"], units["camera_pose[0,3]"]) == ("1", "m")
    names = list(mixed.coordinate.values)
    for name, unit in zip(names, mixed.coordinate_unit.values, strict=True):
        assert rs.logs.to_table(mixed).attrs["units"][f"q[{name}]"] == unit


def test_a_table_is_written_as_csv(batch, tmp_path):
    rs.logs.to_table(batch).to_csv(tmp_path / "run.csv", index=False)
    header, *rows = (tmp_path / "run.csv").read_text(encoding="utf-8").splitlines()
    assert header.startswith("run,time,outcome,") and len(rows) == 33


def test_an_invalid_table_is_reported(demo):
    with pytest.raises(rs.errors.InputError, match="expected a run, a Dataset of simulate, got 3"):
        rs.logs.to_table(3)
    with pytest.raises(rs.errors.InputError, match="no table of 'step'; did you mean 'steps'"):
        rs.logs.to_table(demo, of="step")
