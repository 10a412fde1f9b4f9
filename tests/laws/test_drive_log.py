"""The log of a drive: the state of the controller in its rows, and the run that they become."""

import numpy as np
import pandas
import pytest

import robsim as rs

DT = 0.02
IMAGE_TIME = "image_time[camera,plate]"


@pytest.fixture(scope="module")
def arm():
    safety = rs.Safety(acceleration=2.0, ramp=0.3)
    scenario = rs.load_scenario(rs.examples.path("eye_in_hand"))
    return scenario.with_(dt=DT, safety=safety).at("task.tolerance", 1e-3)


def drive(experiment, jitter=0.0, late=0, every=1, seed=0, until=("converged",)):
    """Rows and last command of an arm that executes its commands, with images some calls old.

    Calls come up to `jitter` periods early or late.
    """
    rng, controller = np.random.default_rng(seed), rs.Controller(experiment)
    q, rows, past, t, command = experiment.start.copy(), [], [], 0.0, None
    while command is None or command.phase not in until:
        step = len(rows)
        t = max(t, (step + (rng.uniform(-jitter, jitter) if step else 0.0)) * experiment.dt)
        past.append((t, q))
        image = None
        if step % every == 0:
            taken, place = past[max(0, step - late)]
            marks = experiment.scene.view(place, points="plate").pixels
            image = rs.control.Marks(marks, taken)
        command = controller.step(image, q, t)
        rows.append(controller.row())
        q = q + experiment.dt * command.velocities
        assert len(rows) < 2000
    return rows, command


@pytest.mark.parametrize(
    ("jitter", "late", "every"), [(0.0, 0, 1), (0.3, 0, 1), (0.3, 2, 3), (0.0, 2, 2), (0.3, 1, 4)]
)
@pytest.mark.few(2)
def test_a_log_ends_converged_as_its_controller_did(arm, jitter, late, every):
    """The last image may be some periods older than the last row."""
    rows, command = drive(arm, jitter, late, every)
    run = rs.logs.read_log(rows, arm)
    assert command.phase == "converged"
    assert rs.Outcome(int(run.outcome)) is rs.Outcome.CONVERGED
    assert "the log ends converged" in str(rs.explain(run, trials=False))
    assert run.attrs["converged_at"] == pytest.approx((len(rows) - 1) * DT, abs=1.5 * DT)


def test_a_log_does_not_end_converged_before_its_controller(arm):
    """At the goal without permission to move, the error is small and nothing has converged."""
    held = arm.with_(safety=rs.Safety(acceleration=2.0, hold_to_run=True))
    goal = arm.run().q_end.values
    marks, controller, rows = arm.scene.view(goal, points="plate").pixels, rs.Controller(held), []
    for step in range(4):
        controller.step(marks, goal, step * DT)
        rows.append(controller.row())
    run = rs.logs.read_log(rows, held)
    assert np.abs(run.error.values).max() < arm.task.tolerance
    assert rs.Outcome(int(run.outcome)) is rs.Outcome.RUNNING
    assert rs.logs.to_table(run).phase.tolist() == ["holding"] * 4
    assert run.limits.values.tolist() == ["not released"] * 4
    end = str(rs.explain(run, trials=False))
    assert "the robot is held (not released)" in end


def test_a_row_has_the_state_of_the_controller_and_the_time_of_its_image(arm):
    controller, q = rs.Controller(arm), arm.start
    marks = arm.scene.view(q, points="plate").pixels
    controller.step(rs.control.Marks(marks, 0.99), q, 1.0)
    row = controller.row()
    assert (row["phase"], row["limits"], row["fault"]) == ("moving", "", "")
    assert (row["time"], row[IMAGE_TIME]) == (1.0, 0.99)
    controller.step(None, q, 1.0 + DT)
    assert np.isnan(controller.row()[IMAGE_TIME])
    command = controller.step({"plate": "nothing"}, q, 1.0 + 1.2 * DT)
    row = controller.row()
    assert command.health.fault and row["fault"] == command.health.fault
    command = controller.step(marks[:2], q, 1.0 + 2 * DT)
    row = controller.row()
    assert row["fault"] == command.health.fault != "" and row["phase"] == "holding"


def test_the_state_survives_files_and_tables(arm, tmp_path):
    rows, _ = drive(arm, late=1, every=2)
    rows[7]["fault"] = 'pixels, "odd": ä'
    run = rs.logs.read_log(rows, arm)
    pandas.DataFrame(rows).to_csv(tmp_path / "drive.csv", index=False)
    again = rs.logs.read_log(tmp_path / "drive.csv", arm)
    for name in ("phase", "limits", "fault", "image_age", "qd", "pixels", "outcome"):
        np.testing.assert_array_equal(run[name].values, again[name].values)
    opened = rs.open_run(rs.save_run(run, tmp_path / "drive.nc"))
    assert opened.identical(run) and opened.fault.values[7] == 'pixels, "odd": ä'
    assert rs.logs.to_table(opened).phase.tolist() == [row["phase"] for row in rows]


def test_late_images_give_the_commands_of_the_controller_again(arm):
    """Depths belong to the joints at the capture time, which the rows contain."""
    rows, _ = drive(arm.at("task.interaction", "current"), late=2, every=2)
    run = rs.logs.read_log(rows, arm.at("task.interaction", "current"))
    assert rs.replay(run).identical(run)  # a differing command is a warning, and an error here
    np.testing.assert_allclose(run.image_age.values[4:8, 0], [0.04, 0.06, 0.04, 0.06], atol=1e-9)


def test_an_image_without_marks_is_an_image(arm):
    rows, _ = drive(arm)
    rows = [dict(row) for row in rows[:12]]
    for name in [name for name in rows[8] if name.startswith("pixels")]:
        rows[8][name] = np.nan
    run = rs.logs.read_log(rows, arm)
    assert np.isnan(run.pixels.values[8]).all() and run.image_age.values[8].max() == 0.0


def test_marks_that_are_lost_after_the_last_command_do_not_change_its_phase(arm):
    rows, _ = drive(arm)
    lost = {name: np.nan for name in rows[-1] if name.startswith("pixels[2")}
    later = {**rows[-1], **lost, "time": rows[-1]["time"] + DT / 4}
    run = rs.logs.read_log([*rows, later], arm)
    assert rs.Outcome(int(run.outcome)) is rs.Outcome.CONVERGED
    stateless = [{k: v for k, v in row.items() if k != "phase"} for row in [*rows[:-1], later]]
    run = rs.logs.read_log(stateless, arm)
    assert rs.Outcome(int(run.outcome)) is rs.Outcome.OUT_OF_IMAGE


def test_impossible_states_are_refused(arm):
    rows, _ = drive(arm)
    rows = rows[:6]
    with pytest.raises(rs.errors.FileError, match="no phase 'convreged'; did you mean 'converged'"):
        rs.logs.read_log([*rows[:5], {**rows[5], "phase": "convreged"}], arm)
    with pytest.raises(rs.errors.FileError, match=r"image of row 5 was taken at 5\.1 s, after"):
        rs.logs.read_log([*rows[:5], {**rows[5], IMAGE_TIME: 5.1}], arm)
    missions = [{**row, "phase": "lift"} for row in rows]  # a column of another kind of table
    assert "phase" not in rs.logs.read_log(missions, arm)
    with pytest.raises(rs.errors.InputError, match="units: phase is in no unit"):
        rs.logs.read_log(rows, arm, units={"phase": "deg"})
