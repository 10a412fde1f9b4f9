"""The detection of marks in the diagnosis of a run: misses with reasons, bias and deviation."""

from dataclasses import replace

import numpy as np
import pytest
from pictures.test_detection_in_the_loop import change, experiment  # noqa: F401 - a fixture

import robsim as rs
from robsim.vision import Optics


def test_noise_accounts_for_the_deviation(experiment):  # noqa: F811
    noisy = change(experiment, Optics(read_noise=14.0, bits=7)).with_(duration=0.4, seed=3)
    run = noisy.run()
    found = rs.diagnose(run)
    assert int(found.detection_pictures) == run.sizes["time"]
    assert not found.not_found.size and (found.marks_missed == 0).all()
    true = noisy.scene.camera().camera.K
    measured = run.s.values.reshape(-1, 5, 2) * np.diag(true)[:2] + true[:2, 2]
    deviation = measured - run.pixels.values
    rms = np.sqrt((deviation**2).mean())
    assert float(found.detection_rms) == pytest.approx(rms, rel=0.1)
    np.testing.assert_allclose(found.detection_bias, deviation.mean(axis=(0, 1)), atol=0.1 * rms)
    without = dict(zip(found.optics.values, found.detection_rms_without.values, strict=True))
    assert without.keys() == {"read_noise", "bits"}
    assert without["read_noise"] < 0.9 * without["bits"]
    assert found.detection_error.values.shape == found.time.shape
    rs.plot.diagnosis(found)


def test_marks_that_are_not_found_have_a_reason(experiment):  # noqa: F811
    place, cube = rs.Pose.at(0, 0.02, -0.003), rs.shapes.Block(0.05, 0.05, 0.002)
    cover = rs.Object("cover", cube, pose=place, on="plate")
    scene = replace(experiment.scene, objects=(*experiment.scene.objects, cover))
    task = replace(experiment.task, target="plate", weighting="border")
    found = rs.diagnose(experiment.with_(scene=scene, task=task).run(duration=0.2))
    (reason,) = found.reason.values
    assert reason == "without the other bodies, which hide marks"
    assert int(found.not_found[0]) == int(found.marks_missed.sum()) >= found.time.size
    assert found.detection_rms_without.size == 0


def test_a_run_without_a_detector_has_no_row_of_detection(experiment):  # noqa: F811
    exact = experiment.with_(task=replace(experiment.task, detector=None))
    assert "detection_rms" not in rs.diagnose(exact.run(duration=0.2))


def test_runs_whose_first_picture_lacks_marks_could_not_begin(experiment):  # noqa: F811
    vary = {"cameras.camera.optics.defocus": [0.0, 12.0]}
    blurred = change(experiment, Optics(read_noise=1.0)).with_(duration=0.2)
    counts = rs.study(blurred, 1, vary=vary).counts()
    ((runs, began, _),) = counts.rows.values()
    assert (runs, began) == (2, 1)
    assert counts.unstarted == {rs.Outcome.UNDETECTED.words: 1}
