"""The report of `robsim run` and `explain` on the pose at which a run ended."""

import pytest

import robsim as rs


@pytest.mark.parametrize("name", ["car", "straight_image_lines"])
def test_convergence_at_another_pose_is_reported(name, tmp_path, called):
    path = rs.examples.path(name)
    status, out, _ = called("run", str(path), "--no-figures", "-o", str(tmp_path / "run"))
    run = rs.open_run(tmp_path / "run" / "run.nc")
    assert status == 0 and int(run.outcome) == rs.Outcome.CONVERGED
    away = f"{1000 * float(run.distance_to_goal):.3g} mm"
    assert away in out and "note         it converged at another pose: robsim explain" in out
    message = str(rs.explain(run, trials=False))
    assert away in message and "off its goal pose" in message
    assert ("A pose has six numbers" in message) == (name == "car")


def test_a_run_that_arrives_reports_it_and_warns_of_nothing(tmp_path, called):
    path = rs.examples.path("visp_tutorial")
    out = called("run", str(path), "--no-figures", "-o", str(tmp_path / "run"))[1]
    assert "final pose   camera 0.0176 mm and 0.00123 degrees from its goal" in out
    assert "note" not in out
