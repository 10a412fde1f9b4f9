"""Stored instants of a study: lazy reading, and the message for each kind of damage."""

import os
import shutil

import numpy as np
import pytest
import xarray as xr
import zarr

import robsim as rs

RUNS = 300  # in two chunks of Zarr
ONE = rs.load_scenario(rs.examples.path("visp_tutorial")).with_(duration=0.2)
GAIN = {"task.gain": rs.samplers.Uniform(1, 2)}


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    """The folder of a study with trajectories, in three parts."""
    return rs.study(
        ONE, RUNS, vary=GAIN, trajectories=1, chunk=110, store=tmp_path_factory.mktemp("study")
    ).folder


@pytest.fixture
def folder(kept, tmp_path):
    return shutil.copytree(kept, tmp_path / "study")


def test_any_selection_is_read_as_from_memory(kept):
    whole = rs.open_study(kept).trajectories().load()
    assert whole.q.shape[:2] == (RUNS, len(whole.time)) and np.isfinite(whole.q.values[:, 0]).all()
    for choice in (
        {"run": 7},
        {"run": slice(250, 280, 3), "time": -1},
        {"run": [299, 0, 256], "coordinate": [5, 1]},
        {"run": [], "time": slice(1, 3)},
        {"time": [0, 2], "velocity": 3},
    ):
        lazy = rs.open_study(kept).trajectories()
        xr.testing.assert_identical(lazy.isel(choice).load(), whole.isel(choice))


def test_another_program_reads_the_same_numbers(kept):
    whole = rs.open_study(kept).trajectories()
    group = zarr.open_group(kept / "trajectories.zarr", mode="r")
    for name in ("q", "qd", "error_norm"):
        np.testing.assert_array_equal(group[name][:], whole[name].values)
        codecs = [type(codec).__name__ for codec in group[name].metadata.codecs]
        assert codecs == ["BytesCodec", "ZstdCodec", "Crc32cCodec"]
    np.testing.assert_array_equal(group["time"][:], whole.time.values)


def flip(path):
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 4
    path.write_bytes(content)


def swap(path):
    other = path.parents[1] / "1" / "0" if path.parent.name == "0" else None
    content = path.read_bytes()
    path.write_bytes(other.read_bytes())
    other.write_bytes(content)


def pipe(path):
    path.unlink()
    os.mkfifo(path)


@pytest.mark.parametrize(
    ("damage", "reason"),
    [
        (flip, "zarr/error_norm is damaged: .*checksum"),
        (os.unlink, "the instants of run 0 are missing, damaged or of another study; replay.0."),
        (swap, "the instants of run 0 are missing, damaged or of another study"),
        (pipe, "this is a pipe"),
    ],
)
def test_a_damaged_chunk_is_an_error_of_its_runs(damage, reason, folder):
    damage(folder / "trajectories.zarr" / "error_norm" / "c" / "0" / "0")
    with pytest.raises(rs.errors.FileError, match=reason):
        _ = rs.open_study(folder).trajectories().error_norm.values
    if damage is not pipe:
        trajectories = rs.open_study(folder).trajectories()
        assert np.isfinite(trajectories.q.values[:, 0]).all()
        if damage is not swap:
            assert np.isfinite(trajectories.error_norm.sel(run=299).values[0])


def test_a_chunk_of_another_seed_is_of_another_study(folder, tmp_path):
    other = rs.study(ONE, RUNS, vary=GAIN, seed=9, trajectories=1, store=tmp_path / "other").folder
    shutil.rmtree(folder / "trajectories.zarr")
    shutil.copytree(other / "trajectories.zarr", folder / "trajectories.zarr")
    with pytest.raises(rs.errors.FileError, match="the instants of run 0 are missing, damaged or"):
        rs.open_study(folder).trajectories().load()


def test_a_study_that_has_not_begun_has_no_trajectories(folder):
    for path in folder.glob("rows-*"):
        path.unlink()
    with pytest.raises(rs.errors.InputError, match="no runs yet, so it has no trajectories"):
        rs.open_study(folder).trajectories()
