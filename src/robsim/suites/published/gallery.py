"""Gallery: numbers of docs/gallery that scenarios must reproduce."""

from __future__ import annotations

from math import radians

from robsim.suites.reproduction import PublishedNumber, Reproduction

CURRENT, DESIRED, MEAN = (f"task.interaction={each}" for each in ("current", "desired", "mean"))
PBVS, HYBRID, PARTITIONED = (f"task.kind={each}" for each in ("pbvs", "hybrid", "partitioned"))
CAMERA_FORM = "task.form=camera"
ONE, LOST, MINIMUM = "schemes_compared", "pbvs_loses_target", "local_minimum"
TILTED, RETREAT = "tilted_square", ("start.rotvec=0, 0, 120 deg", "run.dt=0.5 ms")
NUMBERS = (
    PublishedNumber(ONE, (CURRENT,), "path_length", 1.80, 0.005),
    PublishedNumber(ONE, (CURRENT,), "retreat", 0.735, 0.0005),
    PublishedNumber(ONE, (CURRENT,), "image_detour", 2.5, 0.05),
    PublishedNumber(ONE, (DESIRED,), "path_length", 2.78, 0.005),
    PublishedNumber(ONE, (DESIRED,), "retreat", 0.0, 0.0005),
    PublishedNumber(ONE, (DESIRED,), "image_detour", 279.0, 0.5),
    PublishedNumber(ONE, (MEAN,), "path_length", 0.40, 0.005),
    PublishedNumber(ONE, (MEAN,), "image_detour", 70.0, 0.5),
    PublishedNumber(ONE, (PBVS,), "path_length", 0.206, 0.0005),
    PublishedNumber(ONE, (PBVS,), "image_detour", 85.0, 0.5),
    PublishedNumber(ONE, (PBVS, CAMERA_FORM), "path_length", 0.31, 0.005),
    PublishedNumber(ONE, (PBVS, CAMERA_FORM), "image_detour", 48.0, 0.5),
    PublishedNumber(ONE, (HYBRID,), "path_length", 0.28, 0.005),
    PublishedNumber(ONE, (HYBRID,), "image_detour", 96.0, 0.5),
    PublishedNumber(ONE, (PARTITIONED,), "path_length", 2.98, 0.005),
    PublishedNumber(ONE, (PARTITIONED,), "retreat", 0.110, 0.0005),
    PublishedNumber(ONE, (PARTITIONED,), "image_detour", 65.0, 0.5),
    PublishedNumber(LOST, ("task.kind=ibvs",), "path_length", 2.2, 0.05),
    PublishedNumber(LOST, (HYBRID, "task.mark=4"), "path_length", 0.745, 0.0005),
    PublishedNumber(LOST, (CAMERA_FORM,), "path_length", 0.738, 0.0005),
    PublishedNumber(LOST, ("task.kind=ibvs", MEAN), "path_length", 0.864, 0.0005),
    PublishedNumber(MINIMUM, (), "distance_to_goal", 0.549, 0.0005),
    PublishedNumber(MINIMUM, (), "angle_to_goal", radians(31.7), radians(0.05)),
    PublishedNumber(MINIMUM, (), "pixel_error", 1.34, 0.005),
    PublishedNumber(MINIMUM, (MEAN,), "distance_to_goal", 0.0, 0.001),
    PublishedNumber(TILTED, (), "distance_to_goal", 1.40, 0.005),
    PublishedNumber(TILTED, (), "angle_to_goal", radians(86.5), radians(0.05)),
    PublishedNumber(TILTED, (MEAN,), "distance_to_goal", 0.0, 0.001),
    PublishedNumber("calibration_errors", (), "distance_to_goal", 0.0909, 0.00005),
    PublishedNumber("camera_retreat", (CURRENT, *RETREAT), "retreat", 1.0006, 0.00005),
)


def suite() -> Reproduction:
    """Return the suite."""
    return Reproduction(
        "gallery",
        1,
        "published results, run again",
        "docs/gallery, which cites the paper of each",
        "the value is within half of the last printed digit; a goal is met to 1 mm",
        NUMBERS,
    )
