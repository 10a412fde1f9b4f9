"""Late and hidden images of a target that moves on its own, and of two cameras."""

import numpy as np
import pytest

import robsim as rs

DT = 0.04
quiet = pytest.mark.filterwarnings("ignore::robsim.errors.RankWarning")


@quiet
@pytest.mark.parametrize("share", [0.5, 1.25])
@pytest.mark.parametrize("actuation", [None, rs.Actuation(lag=0.08, acceleration=4.0)])
def test_the_image_of_a_moving_target_is_late_as_well(arrange, share, actuation):
    """Revolute joints between two instants: linear without a lag, and exponential with one."""
    scene, whole = arrange("turntable"), int(np.ceil(share))
    sensing = rs.Sensing(latency=share * DT)
    options = {"dt": DT, "duration": 1.5, "hold": True, "sensing": sensing, "actuation": actuation}
    run = rs.simulate(scene, rs.IBVS(features="pixels"), **options)
    after = (whole - share) * DT
    for k in range(whole, len(run.time)):
        q = run.q.values[k - whole].copy()
        rates = run.qd.values[k - whole].copy()
        if actuation:
            rates[:2] = _mean(rates[:2], run.qd_actual.values[k - whole, :2], after)
        seen = scene.view(q + after * rates).pixels
        np.testing.assert_allclose(run.s.values[k], seen.ravel(), rtol=0, atol=1e-9)


def _mean(command, start, seconds, lag=0.08, rate=4.0, steps=1000):
    """Mean velocity by the midpoint rule of v' = clip((command - v) / lag, +-rate)."""
    h, v, way = seconds / steps, start.copy(), 0.0
    for _ in range(steps):
        middle = v + 0.5 * h * np.clip((command - v) / lag, -rate, rate)
        way = way + h * middle
        v = v + h * np.clip((command - middle) / lag, -rate, rate)
    return way / seconds


def test_a_mark_hidden_from_one_camera_is_seen_by_the_other(arrange):
    scene = arrange("stereo_in_hand")
    features = [rs.features.FeatureBlock("points", camera=name) for name in ("left", "right")]
    task = rs.IBVS(features=features)
    hidden = rs.imperfections.Occlusion([0, 1], 0.2, 0.5, camera="left")
    q0 = scene.home + 0.02
    run = rs.simulate(scene, task, q0, duration=1.0, sensing=rs.Sensing(occlusions=hidden))
    count = run.s.shape[1] // 2
    during = run.time.values[1:-1][(run.time.values[1:-1] > 0.24) & (run.time.values[1:-1] < 0.46)]
    moved = np.abs(np.diff(run.s.sel(time=during, method="nearest").values, axis=0)).max(axis=0)
    assert (moved[:4] == 0).all() and (moved[4:count] > 0).all() and (moved[count:] > 0).all()


@quiet
@pytest.mark.parametrize(
    ("name", "task"),
    [
        ("unicycle", rs.Docking()),
        ("stereo_beside", rs.Placing(camera=("left", "right"))),
        ("mobile_arm", rs.Partitioned()),
        (
            "head_and_arm",
            rs.Parallel(
                [rs.IBVS(camera="watch", target="dish"), rs.Hybrid(camera="camera", target="plate")]
            ),
        ),
    ],
)
def test_schemes_with_laws_of_their_own_live_with_everything(arrange, around, name, task):
    """Alone and in a batch the same bits, all finite until the end."""
    scene = arrange(name)
    occlusion = rs.imperfections.Occlusion([1], 0.2, 0.4)
    options = {
        "sensing": rs.Sensing(0.2, 0.1, 0.0, 0.0, [occlusion], 0.2, 0.055, 0.08),
        "actuation": rs.Actuation(0.05, 2.0, 9.0, 1e-4),
        "duration": 1.2,
    }
    q0 = around(scene, 3, spread=0.02, seed=3)
    whole = rs.simulate(scene, task, q0, **options)
    alone = rs.simulate(scene, task, q0[2], first_run=2, **options)
    assert rs.replay(whole).identical(whole)
    for what in ("q", "qd", "s", "qd_actual"):
        np.testing.assert_array_equal(whole[what][2], alone[what], err_msg=what)
    lived = whole.time.values <= whole.end_time.values[:, None]
    assert np.isfinite(whole.q.values[lived]).all() and np.isfinite(whole.s.values[lived]).all()
    assert (whole.end_time > 0.5).all()
