"""Calibrations from views by OpenCV and SciPy: a misfit is found, named by its cause, and widened.

The tag and the board are seen from a UR5e; each fault is one that a user makes.
"""

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest

import robsim as rs
from robsim.calibration.calibration_model import twist_from_pose
from robsim.statistics.fisher_distribution import fisher_quantile

FILE = Path(__file__).parent / "calibration_views_opencv.json"
DATA = json.loads(FILE.read_text(encoding="utf-8"))
CASES = {case["name"]: case for case in DATA["cases"]}
NOISE = DATA["noise"]


def views_of(case, *, size=1.0, focal=1.0, marks=None, q=None, pixels=None):
    """The views of a user who believes this size of the target and this focal length."""
    K = np.diag([focal, focal, 1.0]) @ DATA["K"]
    K[:2, 2] = np.array(DATA["K"])[:2, 2]
    lens = rs.Camera(K, DATA["size"], distortion=tuple(DATA["distortion"]))
    arm = rs.robots.ur5e()
    scene = rs.Scene(
        [arm],
        [rs.Object("target", marks=size * np.array(case["marks"]) if marks is None else marks)],
        [rs.MountedCamera("eye", lens, on=f"{arm.name}.flange")],
    )
    q = case["q"] if q is None else q
    return rs.calibration.CalibrationViews(scene, q, case["pixels"] if pixels is None else pixels)


def mount_error(found, case):
    """The twist (6,) from an estimated mount to the true mount."""
    return twist_from_pose(found.mount.inv() @ rs.Pose(case["mount"]))


def is_held(found, case):
    """Whether the ellipsoid of 95 percent contains the true mount."""
    d = mount_error(found, case)
    bound = 6 * fisher_quantile(0.95, 6, found.freedom)
    return d @ np.linalg.solve(found.covariance[:6, :6], d) <= bound


@pytest.mark.parametrize(("level", "n", "quantile"), DATA["chi2"])
def test_quantiles_of_chi_square_agree_with_scipy(level, n, quantile):
    assert n * fisher_quantile(level, n, np.inf) == pytest.approx(quantile, rel=1e-12)


@pytest.mark.parametrize(("level", "n", "m", "quantile"), DATA["fisher"])
def test_quantiles_of_fisher_agree_with_scipy(level, n, m, quantile):
    assert fisher_quantile(level, n, m) == pytest.approx(quantile, rel=1e-9)


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("noise", [NOISE, None])
def test_views_without_a_fault_have_no_misfit(name, noise):
    """Warnings are errors here."""
    case = CASES[name]
    found = rs.calibrate(views_of(case), noise=noise)
    assert found.misfit == "" and found.trials == () and is_held(found, case)
    assert np.linalg.norm(mount_error(found, case)[:3]) < 2e-4
    assert found.test.noise == pytest.approx(NOISE, rel=0.2)


@pytest.mark.parametrize("noise", [NOISE, None])
def test_a_tag_that_is_printed_five_percent_too_small_is_named(noise):
    """It moved the mount by 7.8 mm, reported as 0.11 mm, without a warning."""
    case = CASES["tag"]
    views = views_of(case, size=1 / 0.95)
    with pytest.warns(rs.errors.FitWarning, match=r"marks 0\.95 times as large give 0\.13\d px"):
        found = rs.calibrate(views, noise=noise)
    assert found.rms > 2.5 and np.linalg.norm(mount_error(found, case)[:3]) > 7e-3
    assert is_held(found, case)
    best, *others = found.trials
    assert best.explains and not any(other.explains for other in others)
    assert np.linalg.norm((best.mount.inv() @ rs.Pose(case["mount"])).position) < 3e-4
    again = rs.calibrate(views, ["scale"], noise=noise)
    assert again.misfit == "" and is_held(again, case)
    assert again.model.scale == pytest.approx(0.95, abs=3 * again.deviations["scale"])
    marks = again.scene.object("target").marks
    np.testing.assert_allclose(marks, again.model.scale * views.thing.marks)


def with_view(values, view, other):
    """Values of views, with one view that has those of another view."""
    changed = np.array(values)
    changed[view] = changed[other]
    return changed


def changed_joint(case, joint, factor=1.0, offset=0.0):
    """Coordinates with one joint that is reversed or has an offset."""
    q = np.array(case["q"])
    q[:, joint] = factor * q[:, joint] + offset
    return q


def by_columns(case):
    """The marks of the board in the order of columns."""
    return np.array(case["marks"]).reshape(5, 7, 3).swapaxes(0, 1).reshape(-1, 3)


def turned_board(case):
    """A board of five columns and seven rows, where there are seven and five."""
    i = np.arange(35)
    return np.stack([0.03 * (i % 5), 0.03 * (i // 5), 0 * i], axis=1)


FAULTS = {
    "size": ("board", lambda c: views_of(c, size=1 / 1.01), "marks 1.01 times as large"),
    "millimetres": (
        "tag",
        lambda c: views_of(c, size=1e3),
        r"0\.001 times as large \(marks in millimetres",
    ),
    "focal": ("tag", lambda c: views_of(c, focal=0.87), "focal lengths 1.15 times as long"),
    "joint": (
        "board",
        lambda c: views_of(c, q=changed_joint(c, 3, offset=0.02)),
        r"encoders with an offset of -1\.1\d deg of joint 'wrist_1'",
    ),
    "duplicate": (
        "tag",
        lambda c: views_of(c, pixels=with_view(c["pixels"], 3, 4)),
        "all views but view 3",
    ),
    "columns": ("board", lambda c: views_of(c, marks=by_columns(c)), "marks in the order of rows"),
    "rows": (
        "tag",
        lambda c: views_of(c, pixels=[0, 959] + np.array(c["pixels"]) * [1, -1]),
        "rows counted from the bottom",
    ),
}
MORE_FAULTS = {
    "board": (
        "board",
        lambda c: views_of(c, marks=turned_board(c)),
        "marks in (7 columns and 5 rows|columns from top to bottom)",  # the same board, turned
    ),
    "small focal": ("board", lambda c: views_of(c, focal=1.02), "focal lengths 0.98 times"),
    "two views": (
        "tag",
        lambda c: views_of(c, q=np.array(c["q"])[[0, 1, 2, 4, 3, *range(5, 15)]]),
        "all views but views 3 and 4",
    ),
    "next view": (
        "tag",
        lambda c: views_of(c, q=c["q"][:-1], pixels=c["pixels"][1:]),
        "joints of the next view",
    ),
    "sign": (
        "tag",
        lambda c: views_of(c, q=changed_joint(c, 2, factor=-1.0)),
        "opposite signs of joint 'forearm'",
    ),
    "all signs": (
        "board",
        lambda c: views_of(c, q=-np.array(c["q"])),
        "opposite signs of all joints",
    ),
    "swapped joints": (
        "board",
        lambda c: views_of(c, q=np.array(c["q"])[:, [0, 2, 1, 3, 4, 5]]),
        "joints 'upper_arm' and 'forearm' in each other's place",
    ),
    "joint order": (
        "tag",
        lambda c: views_of(c, q=np.array(c["q"])[:, ::-1]),
        "all joints in reverse order",
    ),
}


def check_cause(fault, noise):
    """The warning names the cause, the fit under this cause is right, and the interval holds."""
    name, make, cause = fault
    views = make(CASES[name])
    with pytest.warns(rs.errors.FitWarning, match=rf"px: [^;]*{cause}[^,]* give 0\.1[234]\d? px"):
        found = rs.calibrate(views, noise=noise)
    assert found.trials[0].explains and is_held(found, CASES[name])
    off = (found.trials[0].mount.inv() @ rs.Pose(CASES[name]["mount"])).position
    assert np.linalg.norm(off) < 5e-4


@pytest.mark.full
@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_named(fault):
    check_cause(FAULTS[fault], NOISE)


@pytest.mark.full
@pytest.mark.parametrize("fault", [*FAULTS, *MORE_FAULTS])
def test_every_fault_is_named_with_estimated_noise(fault):
    check_cause({**FAULTS, **MORE_FAULTS}[fault], None)


def test_noise_that_is_given_too_small_is_named():
    case = CASES["board"]
    with pytest.warns(
        rs.errors.FitWarning, match=r"noise of 0\.05 px: pixels with more noise than"
    ):
        found = rs.calibrate(views_of(case), noise=0.05)
    honest = rs.calibrate(views_of(case))
    assert found.sigma >= honest.sigma and is_held(found, case)
    assert (np.diag(found.covariance) >= np.diag(honest.covariance) * (1 - 1e-12)).all()


def test_intervals_are_as_wide_as_the_residuals_although_the_noise_is_given_smaller():
    """A noise 3 percent too small is no misfit, and the residuals count nevertheless."""
    views = views_of(CASES["board"])
    honest = rs.calibrate(views)
    found = rs.calibrate(views, noise=honest.sigma / 1.03)
    assert found.misfit == ""
    np.testing.assert_allclose(found.covariance, honest.covariance, rtol=1e-12)


@pytest.mark.full
@pytest.mark.parametrize("name", CASES)
def test_intervals_widen_with_errors_of_the_robot(name):
    """Errors of 0.03 degrees of all joints: the 95 percent contained 0 to 15 percent of mounts."""
    rng, case, held = np.random.default_rng(2), CASES[name], []
    for _ in range(8):
        q = case["q"] + rng.normal(0, 5e-4, np.shape(case["q"]))
        with pytest.warns(rs.errors.FitWarning):
            held.append(is_held(rs.calibrate(views_of(case, q=q)), case))
    assert np.mean(held) >= 0.75


def test_the_mount_is_printed_as_scipy_gives_it():
    """With exact pixels: position, rpy, quaternion and rotation vector, each under its name."""
    case, forms = CASES["board"], DATA["mount_forms"]
    views = views_of(case)
    exact = views.scene.replacing(
        rs.MountedCamera("eye", views.lens, on=views.eye.on, pose=rs.Pose(case["mount"])),
        rs.Object("target", marks=case["marks"], pose=rs.Pose(case["place"])),
    )
    pixels = exact.view(np.array(case["q"])).pixels
    text = str(rs.calibrate(rs.calibration.CalibrationViews(exact, case["q"], pixels)))
    names = {
        "mount position": 1e3 * np.array(forms["position"]),
        "mount rpy": forms["rpy"],
        "mount quaternion (x, y, z, w)": forms["quaternion"],
        "mount rotation vector": forms["rotvec"],
    }
    for name, values in names.items():
        line = next(line for line in text.splitlines() if line.startswith(name))
        printed = line.removeprefix(name).split()[: len(values)]
        np.testing.assert_allclose(np.array(printed, dtype=float), values, rtol=1e-5)
    assert " mm" in text and " deg" in text


def test_the_toml_that_is_printed_is_the_camera(tmp_path):
    found = rs.calibrate(views_of(CASES["tag"]), ["focal", "center"])
    text = str(found).partition("\n[[cameras]]")[2]
    assert f"[[cameras]]{text}\n" == found.to_toml()
    assert list(tomllib.loads(found.to_toml())["cameras"][0])[:4] == [
        "name",
        "on",
        "position",
        "rpy",
    ]
    scenario = rs.Experiment(found.scene, rs.IBVS()).to_toml()
    head, tail = scenario.split("[[cameras]]")[0], scenario[scenario.index("[task]") :]
    path = tmp_path / "cell.toml"
    path.write_text(f"{head}{found.to_toml()}\n{tail}", encoding="utf-8")
    eye = rs.load_scenario(path).scene.camera()
    np.testing.assert_allclose(eye.pose.matrix, found.mount.matrix, atol=1e-9)
    np.testing.assert_allclose(eye.camera.K, found.camera.K, rtol=1e-9)
    assert eye.camera.distortion == found.camera.distortion and eye.on == found.views.eye.on


def test_deviations_of_position_and_rpy_are_in_the_axes_of_their_values():
    """Against samples of the covariance, whose twists are in camera axes."""
    found = rs.calibrate(views_of(CASES["tag"]))
    twists = np.random.default_rng(1).multivariate_normal(np.zeros(12), found.covariance, 20000)
    poses = found.mount @ rs.Pose.exp(twists[:, :6])
    rpy = np.degrees([rotation for rotation in _rpy(poses.rotation)])
    wanted = np.concatenate([1e3 * poses.position.std(axis=0), rpy.std(axis=0)])
    rows = {row[0]: row for row in (line.split("  ") for line in str(found).splitlines()) if row}
    stds = [[each for each in rows[f"mount {name}"] if each][-3:] for name in ("position", "rpy")]
    np.testing.assert_allclose(np.array(stds, dtype=float).ravel(), wanted, rtol=0.06)


def _rpy(R):
    """Roll, pitch and yaw of R (n, 3, 3)."""
    return np.stack(
        [
            np.arctan2(R[:, 2, 1], R[:, 2, 2]),
            np.arcsin(-R[:, 2, 0]),
            np.arctan2(R[:, 1, 0], R[:, 0, 0]),
        ],
        axis=1,
    )
