"""The same bits: alone or in a batch, for any chunk and number of threads, again and reopened."""

import numpy as np
import pytest

import robsim as rs

VARIANTS = {
    "plain": (rs.IBVS, {}, {}),
    "noise": (rs.IBVS, {"tolerance": 3e-3}, {"sensing": rs.Sensing(noise=0.5), "seed": 11}),
    "pixels mean camera law": (
        rs.IBVS,
        {
            "features": rs.features.PixelPoints(),
            "interaction": "mean",
            "law": rs.laws.CameraLaw(0.01),
        },
        {},
    ),
    "desired damped goal depth": (
        rs.IBVS,
        {
            "interaction": "desired",
            "depth": "goal",
            "inverse": rs.laws.DampedInverse(0.02),
            "tolerance": 5e-3,
        },
        {"sensing": rs.Sensing(noise=1.0)},
    ),
}
SETTINGS = {"dt": 0.05, "duration": 4.0}


def same(a, b):
    """All variables equal bit for bit (NaN where NaN)."""
    assert set(a.variables) == set(b.variables)
    for name in a.variables:
        x, y = a[name].values, b[name].values
        assert x.shape == y.shape and x.dtype == y.dtype, name
        assert x.tobytes() == y.tobytes(), name


@pytest.fixture(params=VARIANTS, ids=lambda name: name.replace(" ", "_"))
def batch(request, puma_scene, puma_goal, puma_starts):
    kind, task, settings = VARIANTS[request.param]
    chosen = kind(goal=puma_goal, gain=3.0, **task)

    def run(q0=puma_starts, **changes):
        return rs.simulate(puma_scene, chosen, q0, **{**SETTINGS, **settings, **changes})

    return run


def test_the_batch_has_runs_that_end_at_different_times_and_for_different_reasons(batch):
    run = batch()
    assert len(np.unique(run.end_time)) > 2
    assert len(np.unique(run.outcome)) > 1


def test_a_single_run_equals_its_row_in_a_batch(batch, puma_starts):
    rows = batch()
    for i in (0, 5, 12):
        same(batch(puma_starts[i], first_run=i), rows.isel(run=i))


@pytest.mark.covering(2)
@pytest.mark.parametrize("threads", [1, 2, 3])
@pytest.mark.parametrize("chunk", [1, 3, 7, 64])
def test_chunks_and_threads_do_not_matter(batch, chunk, threads):
    same(batch(), batch(chunk=chunk, threads=threads))


def test_a_rerun_gives_the_same(batch):
    same(batch(), batch())


def test_a_saved_run_comes_back_as_it_was(batch, tmp_path):
    run = batch()
    back = rs.open_run(rs.save_run(run, tmp_path / "run.nc"))
    same(run, back)
    assert {k: str(v) for k, v in back.attrs.items()} == {k: str(v) for k, v in run.attrs.items()}


@pytest.mark.parametrize("which", [slice(None), 4])
def test_a_saved_run_replays_to_the_same_bits(batch, puma_starts, which, tmp_path):
    first = {} if isinstance(which, slice) else {"first_run": which}
    run = batch(puma_starts[which], **first)
    same(run, rs.replay(rs.open_run(rs.save_run(run, tmp_path / "run.nc"))))


def test_a_run_of_one_period_replays(puma_scene, puma_goal, puma_starts):
    run = rs.simulate(puma_scene, rs.IBVS(goal=puma_goal), puma_starts[0], duration=0.04)
    same(run, rs.replay(run))


def test_every_second_step_and_the_summary_are_parts_of_the_whole(batch):
    everything, second, end = batch(), batch(record=2), batch(record="summary")
    np.testing.assert_array_equal(second.q, everything.q[:, ::2])
    np.testing.assert_array_equal(second.camera_velocity, everything.camera_velocity[:, ::2])
    for i, row in enumerate(everything.q_end.values):
        kept = everything.q[i].dropna("time").values
        np.testing.assert_array_equal(row, kept[-1])
    np.testing.assert_array_equal(end.q, everything.q_end)
    np.testing.assert_array_equal(end.end_time, everything.end_time)


def test_another_seed_or_run_number_gives_other_noise(puma_scene, puma_goal, puma_starts):
    task = rs.IBVS(goal=puma_goal)

    def s(**changes):
        run = rs.simulate(
            puma_scene, task, puma_starts[0], sensing=rs.Sensing(noise=1.0), duration=0.2, **changes
        )
        return run.s.values

    assert not np.array_equal(s(seed=1), s(seed=2))
    assert not np.array_equal(s(first_run=1), s(first_run=2))


# vehicles


@pytest.fixture(params=["car", "differential_drive"])
def vehicle(request):
    """Runs of a vehicle from starts that end at different times; a car steers as far as it can."""
    scenario = rs.load_scenario(rs.examples.path(request.param))
    spread = np.zeros((9, scenario.scene.nq))
    spread[:, :3] = np.random.default_rng(2).uniform(-0.1, 0.1, (9, 3))
    starts = scenario.start + spread

    def run(q0=starts, **changes):
        return scenario.run(start=q0, dt=0.1, duration=8.0, **changes)

    return run, starts


SPOILT = {
    "plain": {},
    "late and lagging": {
        "sensing": rs.Sensing(noise=0.5, latency=0.15),
        "actuation": rs.Actuation(lag=0.1),
        "seed": 3,
    },
}


@pytest.mark.parametrize("how", SPOILT)
def test_a_vehicle_alone_equals_its_row_for_any_chunk_and_threads(vehicle, how):
    run, starts = vehicle
    rows = run(**SPOILT[how])
    for i in (0, 8):
        same(run(starts[i], first_run=i, **SPOILT[how]), rows.isel(run=i))
    for chunk, threads in ((1, 2), (4, 3)):
        same(rows, run(chunk=chunk, threads=threads, **SPOILT[how]))


def test_a_saved_run_of_a_vehicle_replays_to_the_same_bits(vehicle, tmp_path):
    run, _ = vehicle
    rows = run()
    same(rows, rs.replay(rs.open_run(rs.save_run(rows, tmp_path / "run.nc"))))
