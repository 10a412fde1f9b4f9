"""Poses without a guess, and motions of homographies, against stored results of OpenCV."""

import json
import runpy
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import robsim as rs

HERE = Path(__file__).parent
CASES = runpy.run_path(str(HERE / "_pnp_cases.py"))
POSES = json.loads((HERE / "poses_opencv.json").read_text())["groups"]
MOTIONS = json.loads((HERE / "homographies_opencv.json").read_text())["cases"]
FAILED = np.radians(10)  # a rotation that is off by more, or none at all, is a failure
EXACT = 1e-14  # radians, and of the distance: below, percentiles compare rounding with rounding


@cache
def ours(kind, noise):
    """Errors (2, views) of rotation and translation, whether flagged, and the sum of pixels."""
    each, flagged, total = [], [], 0.0
    for marks, R, t, pixels in CASES["targets"](kind, noise):
        found = rs.vision.estimate_pose(marks, pixels, rs.Camera(CASES["K"]))
        T = found.T_c_o
        each.append(np.stack(CASES["errors"](T[:, :3, :3], T[:, :3, 3], R, t)))
        flagged.append(found.ambiguous)
        total += pixels.sum()
    return np.concatenate(each, axis=1), np.concatenate(flagged), total


def theirs(group):
    return np.array([group["rotation"], group["translation"]], dtype=float)


def failures(errors):
    return int((~(errors[0] < FAILED)).sum())


def name(group):
    return f"{group['kind']}-{group['noise']:g}px"


@pytest.mark.parametrize("group", POSES, ids=name)
@pytest.mark.few(2)
def test_poses_without_a_guess_are_as_good_as_opencv(group):
    """Median and 95th percentile within 5 percent of IPPE's and SQPNP's, and no more failures."""
    found, _, total = ours(group["kind"], group["noise"])
    assert found.shape == (2, 1000) and abs(total - group["sum"]) < 1e-6  # the same views
    mine, other = (np.where(np.isnan(e), np.inf, e) for e in (found, theirs(group)))
    for share in (0.5, 0.95):
        least = np.maximum(1.05 * np.quantile(other, share, axis=1), EXACT)
        assert (np.quantile(mine, share, axis=1) <= least).all()
    assert failures(found) <= failures(theirs(group))


@pytest.mark.parametrize("kind", CASES["KINDS"])
def test_exact_images_give_the_pose_to_rounding_without_a_failure(kind):
    found, flagged, _ = ours(kind, 0.0)
    assert found.max() < 1e-12 and not flagged.any()


@pytest.mark.full
@pytest.mark.parametrize("kind", CASES["KINDS"])
def test_poses_that_fail_are_flagged_as_ambiguous(kind):
    """With noise; at most two of a thousand are wrong and not flagged."""
    found, flagged, _ = ours(kind, 1.0)
    assert failures(found[:, ~flagged]) <= 2
    assert flagged.mean() < 0.3


@pytest.mark.parametrize("case", MOTIONS, ids=lambda case: f"{case['H'][0][0]:.3f}")
def test_motions_of_a_homography_agree_with_opencv(case):
    """As sets: each of theirs is one of ours, and each of ours one of theirs."""
    found = rs.vision.decompose_homography(case["H"])
    mine = np.concatenate(
        [found.rotations.reshape(4, 9), found.translations, found.normals], axis=1
    )
    other = np.concatenate(
        [np.reshape(case["rotations"], (-1, 9)), case["translations"], case["normals"]], axis=1
    )
    apart = np.abs(mine[:, None] - other).max(-1)
    assert apart.shape == (4, 4)
    assert apart.min(0).max() < 1e-10 and apart.min(1).max() < 1e-10
