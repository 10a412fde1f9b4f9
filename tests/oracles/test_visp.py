"""Features, gains, laws and poses against ViSP 3.5 (visp.json, by generate_visp.cpp).

The "meaning" of a group in the file describes it. Every case gives the marks in camera axes,
so the features are measured here, not only their interaction matrices compared. The tolerance is
1e-10 of the largest entry by default.

Where ViSP's L is not the derivative of its own s, by central differences: the entry vx of x_n of
a dense region (vpFeatureMomentGravityCenterNormalized, off by 1e-3 to 2e-2; 50 digits), replaced
below, and the invariant c5 (vpFeatureMomentCInvariant, off by up to 15 times its size), not used.
"""

import json
from pathlib import Path

import numpy as np
import pytest

from robsim.base.arrays import move_runs_last
from robsim.features.depth import LogDepth
from robsim.features.ellipse import Ellipse
from robsim.features.feature import Observation
from robsim.features.lines import Lines, VanishingPoint
from robsim.features.moments import DecoupledMoments, PointMoments, RegionMoments
from robsim.features.points import Points
from robsim.features.points_3d import Points3D
from robsim.features.polar import Polar
from robsim.features.pose_error import ThetaU, Translation
from robsim.features.segments import Segments
from robsim.features.sphere import Sphere
from robsim.kernels.estimation.pose_fit import fit_pose
from robsim.servo.laws.control_state import ControlState
from robsim.servo.laws.gain import AdaptiveGain
from robsim.servo.laws.inverse import PseudoInverse, multiply_batches
from robsim.servo.laws.law import JointLaw
from robsim.servo.shaping.redundancy import large_projection, null_space
from robsim.vision.camera import Camera

STORED = json.loads((Path(__file__).parent / "visp.json").read_text())


def cases(group):
    return STORED[group]["cases"]


def values(group, key):
    """A field of all cases, stacked."""
    return np.array([case[key] for case in cases(group)])


def observe(marks):
    """An observation of marks (B, N, 3) or (N, 3) given in camera axes."""
    X = move_runs_last(np.asarray(marks, float).reshape(-1, *np.shape(marks)[-2:]), 2)
    points, depth = np.ascontiguousarray(X[:, :2] / X[:, 2:]), np.ascontiguousarray(X[:, 2])
    return Observation(points, points, depth, Camera(np.eye(3)))


def posed(T):
    """An observation with the pose T (B, 4, 4) of the target."""
    view = observe(np.ones((len(T), 3, 3)))
    vars(view)["pose_last"] = move_runs_last(T[:, :3], 2)
    return view


def close(ours, theirs, tolerance=1e-10):
    """The same to within a share of the largest entry of each case."""
    theirs = np.asarray(theirs)
    scale = np.abs(theirs).max(axis=tuple(range(1, theirs.ndim)), keepdims=True)
    np.testing.assert_allclose(ours / scale, theirs / scale, rtol=0, atol=tolerance)


def near(angle, other, period=2 * np.pi):
    """The angle, by as many periods more or less as bring it near the other."""
    return angle + period * np.round((other - angle) / period)


def through(outer, s, L):
    """outer(s) and its interaction matrix by the chain rule, for s (k,) and L (k, 6).

    The derivatives of outer come from a step along the imaginary axis, exact to rounding.
    """
    steps = s + 1e-30j * np.eye(len(s))
    return outer(s), np.stack([outer(z).imag / 1e-30 for z in steps], axis=-1) @ L


@pytest.mark.parametrize(
    ("group", "feature", "angles"),
    [
        ("point", Points(), []),
        ("polar", Polar(), [1]),
        ("point3d", Points3D(), []),
        ("vanishing_point", VanishingPoint(), []),
    ],
)
def test_points(group, feature, angles):
    view, expected = observe(values(group, "marks")), values(group, "s")
    s = feature.measure(view).copy()
    s[:, angles] = near(s[:, angles], expected[:, angles])
    close(s, expected)
    close(feature.interaction(view), values(group, "L"))


def test_the_logarithm_of_depth():
    for case in cases("depth"):
        goal = observe([[0.0, 0.0, case["goal_depth"]]])
        feature, view = LogDepth().towards(goal), observe(case["marks"])
        np.testing.assert_allclose(feature.measure(view)[0], case["s"], rtol=0, atol=1e-14)
        close(feature.interaction(view), [case["L"]])


def test_segments():
    """ViSP's angle is the angle of the direction from the second end to the first."""
    view, expected = observe(values("segment", "marks")[:, ::-1]), values("segment", "s")
    s, L = Segments().measure(view).copy(), Segments().interaction(view)
    s[:, 3] = near(s[:, 3], expected[:, 3])
    close(s, expected)
    close(L, values("segment", "L"))
    for i, case in enumerate(cases("segment_normalised")):
        normalised = through(lambda z: np.array([z[0], z[1], 1, z[2] * z[3]]) / z[2], s[i], L[i])
        close(normalised[0][None], [case["s"]])
        close(normalised[1][None], [case["L"]])


def test_lines():
    """A line is (rho, theta) or (-rho, theta + pi): Lines takes its sense from the marks."""
    view, expected = observe(values("line", "marks")), values("line", "s")
    s, L = Lines().measure(view).copy(), np.array(Lines().interaction(view))
    reversed_ = np.cos(s[:, 1] - expected[:, 1]) < 0
    assert reversed_.any() and not reversed_.all()
    s[reversed_] = s[reversed_] * [-1, 1] + [0, np.pi]
    L[reversed_, 0] *= -1
    s[:, 1] = near(s[:, 1], expected[:, 1])
    close(s, expected)
    close(L, values("line", "L"))


def on_circle(centre, normal, radius):
    """Eight marks."""
    across = np.linalg.svd(np.array([normal]))[2][1:]
    t = np.arange(8) * np.pi / 4
    return centre + radius * np.stack([np.cos(t), np.sin(t)], axis=1) @ across


def test_ellipses_of_circles():
    """ViSP's s of circles that are seen nearly edge-on is itself good to 6e-12 only."""
    for case in cases("circle"):
        view = observe(on_circle(case["centre"], case["normal"], case["radius"]))
        close(Ellipse().measure(view), [case["s"]])
        close(Ellipse().interaction(view), [case["L"]])


def ellipse_of_sphere(s):
    """(xg, yg, n20, n11, n02) of the limb of a sphere, from s = (X, Y, Z) / radius.

    The limb is the conic p' M p = 0, M = s s' - (s's - 1) I (Fomena and Chaumette 2009).
    """
    X, Y, Z = s
    inside = Z * Z - 1
    xx, xy, yy = inside + X * X, X * Y, inside + Y * Y
    return np.array([X * Z, Y * Z, 0, 0, 0]) / inside + np.array([0, 0, xx, xy, yy]) / (
        4 * inside**2
    )


def test_spheres():
    """The features of the limb, as functions of RobSim's s = (X, Y, Z) / radius."""
    for case in cases("sphere"):
        feature, view = Sphere(case["radius"]), observe([case["centre"]])
        s, L = through(ellipse_of_sphere, feature.measure(view)[0], feature.interaction(view)[0])
        close(s[None], [case["s"]])
        close(L[None], [case["L"]])


def inverse(T):
    """(B, 4, 4)."""
    return np.linalg.inv(T)


@pytest.mark.parametrize(
    ("group", "feature", "sign"),
    [
        ("theta_u_cdRc", ThetaU(), 1),
        ("theta_u_cRcd", ThetaU(), -1),
        ("translation_cdMc", Translation(), 1),
        ("translation_cMcd", Translation("camera"), 1),
    ],
)
def test_parts_of_a_pose(group, feature, sign):
    """The target is put at the pose of the goal camera; one rotation vector has the other sign."""
    view = posed(inverse(values(group, "T_goal_c")))
    close(sign * feature.measure(view), values(group, "s"))
    close(sign * feature.interaction(view), values(group, "L"))


def test_the_translation_of_an_object():
    view, feature = posed(values("translation_cMo", "T_c_o")), Translation("camera")
    close(feature.measure(view), values("translation_cMo", "s"))
    close(feature.interaction(view), values("translation_cMo", "L"))


MOMENTS = [("moments_polygon", "region"), ("moments_points", "points")]


def moment_cases():
    return [(case, kind) for group, kind in MOMENTS for case in cases(group)]


@pytest.mark.parametrize(("case", "kind"), moment_cases())
def test_size_centre_and_orientation(case, kind):
    """Orientation is compared modulo pi: ViSP finds its sense from the third moments."""
    feature = RegionMoments() if kind == "region" else PointMoments()
    view = observe(case["marks"])
    s, L = feature.measure(view)[0], feature.interaction(view)[0]
    size, L_size = np.array(case["centred"])[[3, 5]], np.array(case["L_centred"])[[3, 5]]
    if kind == "region":
        size, L_size = np.array(case["area"]), np.array(case["L_area"])
    close(s[:1], size.sum(keepdims=True))
    close(L[None, 0], L_size.sum(0, keepdims=True))
    close(s[None, 1:3], [case["centroid"]])
    close(L[None, 1:3], [case["L_centroid"]])
    np.testing.assert_allclose(near(s[3], case["alpha"][0], np.pi), case["alpha"][0], atol=1e-12)
    close(L[None, 3:], [case["L_alpha"]])


def tilts(mu):
    """(Px, Py) of `DecoupledMoments`, from centred moments in the order of the file."""
    number, _, _, xx, xy, yy, xxx, xxy, xyy, yyy = mu
    px, py, c, s = xxx + xyy, xxy + yyy, xx - yy, 2 * xy
    square, spread = px * px + py * py, xx + yy
    rho = np.sqrt(number * square / spread) / spread
    cos, sin = (px * px - py * py) / square, 2 * px * py / square
    return rho * np.array([cos * c + sin * s, sin * c - cos * s]) / np.sqrt(c * c + s * s)


@pytest.mark.parametrize(("case", "kind"), moment_cases())
def test_decoupled_moments(case, kind):
    """xn, yn, an and alpha as ViSP has them; Px and Py by the chain rule from its L of mu_ij."""
    feature = DecoupledMoments(kind).towards(observe(case["goal_marks"]))
    view, scale = observe(case["marks"]), feature.goal[1, 0] / case["goal_depth"]
    s, L = feature.measure(view)[0], feature.interaction(view)[0]
    an, L_an = np.array(case["area_normalised"]), np.array(case["L_area_normalised"])
    xn, L_xn = np.array(case["centroid_normalised"]), np.array(case["L_centroid_normalised"])
    if kind == "region":  # not ViSP's own, see above, but what follows from its an and xg
        L_xn[0] = an[0] * np.array(case["L_centroid"][0]) + case["centroid"][0] * L_an[0]
    close(s[None, :3], scale * np.r_[xn, an][None])
    close(L[None, :3], scale * np.r_[L_xn, L_an][None])
    P, L_P = through(tilts, np.array(case["centred"]), np.array(case["L_centred"]))
    close(s[None, 3:5], P[None])
    close(L[None, 3:5], L_P[None])
    np.testing.assert_allclose(near(s[5], case["alpha"][0], np.pi), case["alpha"][0], atol=1e-12)
    close(L[None, 5:], [case["L_alpha"]])


def test_adaptive_gains():
    for case in cases("adaptive_gain"):
        gain = AdaptiveGain(case["at_zero"], case["at_infinity"], case["slope"])
        close(gain.at(np.array(case["x"])), case["gain"])


def task(case):
    """Error (k, 1) and interaction matrices (k, 6, 1), now and at the goal, of image points."""
    now, goal = observe(case["marks"]), observe(case["goal_marks"])
    e = Points().measure(now) - Points().measure(goal)
    L, L_goal = (move_runs_last(np.array(Points().interaction(view)), 2) for view in (now, goal))
    return move_runs_last(e, 1), L, L_goal


@pytest.mark.parametrize(("which", "key"), [(0, "v_current"), (1, "v_desired"), (2, "v_mean")])
def test_the_law_of_image_points(which, key):
    eye = np.eye(6)[..., None].copy()
    for case in cases("ibvs"):
        e, L, L_goal = task(case)
        L = (L, L_goal, 0.5 * (L + L_goal))[which]
        close(e.T, [case["e"]])
        state = ControlState(e, L, eye, multiply_batches(L, eye), case["gain"], PseudoInverse())
        close(JointLaw().command(state), [case[key]])


def weight(norm, low=0.1, high=0.7):
    """ViSP's share of the large projection: a sigmoid, cut at both ends (Marey, Chaumette 2010).

    RobSim goes from 0 to 1 without steps, so its share is another one in between.
    """
    if not low <= norm <= high:
        return float(norm > high)
    return 1 / (1 + np.exp(6 - 12 * (norm - low) / (high - low)))


def test_projections_of_a_secondary_motion():
    for case in cases("secondary_task"):
        e, L, _ = task(case)
        norm = np.linalg.norm(e)
        classic = null_space(L, 1e-6)
        keeps_norm = large_projection(L, e, norm / 4, norm / 2, classic)
        w = weight(norm)
        P = w * keeps_norm + (1 - w) * classic
        for ours, theirs in [
            (P, case["P_large"]),
            (P[..., 0] @ case["g"], case["large"]),
            (classic[..., 0] @ case["g"], case.get("classic", np.zeros(6))),
        ]:
            np.testing.assert_allclose(np.squeeze(ours), theirs, rtol=0, atol=1e-12)


def test_estimated_poses():
    """1e-12 of metres and of R; ViSP iterates until its error no longer changes."""
    for case in cases("pose"):
        x = move_runs_last(np.array([case["image"]]), 2)
        guess = move_runs_last(np.array([case["guess"]])[:, :3], 2)
        T = np.empty((3, 4, 1))
        fit_pose(np.array(case["model"])[..., None].copy(), x, guess, T)
        np.testing.assert_allclose(T[..., 0], np.array(case["T_c_o"])[:3], rtol=0, atol=1e-12)
