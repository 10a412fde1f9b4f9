"""Run files: content under a seal, refusals, and foreign files read by an explicit option."""

import hashlib
import json
import os
import re
import sys
import warnings
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray as xr

import robsim as rs
from robsim.container import MAGIC

TAIL = 8 + 32 + len(MAGIC)  # bytes after the index
SECRET = b"of another file"


@pytest.fixture(scope="module")
def run():
    return rs.load_scenario(rs.examples.path("visp_tutorial")).run(duration=0.4)


@pytest.fixture(scope="module")
def saved(run, tmp_path_factory):
    return rs.save_run(run, tmp_path_factory.mktemp("run") / "run.nc").read_bytes()


@pytest.fixture
def path(saved, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = Path("run.nc")
    path.write_bytes(saved)
    return path


def parts(path):
    """The content of a sealed file, and its index."""
    whole = path.read_bytes()
    length = int.from_bytes(whole[-TAIL:][:8], "little")
    return whole[: -TAIL - length], json.loads(whole[-TAIL - length : -TAIL])


def sealed(content, index):
    """A file with a right checksum, whatever its index claims."""
    text = index if isinstance(index, bytes) else json.dumps(index).encode()
    whole = content + text + len(text).to_bytes(8, "little")
    return whole + hashlib.sha256(whole).digest() + MAGIC


def entry(index, name):
    return next(each for each in index["variables"] if each["name"] == name)


# ---- kept content ----


def test_values_types_and_attributes_are_kept_as_they_are(run, tmp_path):
    own = {
        "n": 3,
        "x": -0.0,
        "nan": np.nan,
        "far": np.inf,
        "text": "Grüße\n",
        "small": np.float32(0.5),
    }
    lists = {"flags": np.arange(3, dtype=np.int8), "words": ["a", "b"], "none": np.zeros(0)}
    some = run.assign_attrs({**own, **lists}).assign(
        good=run.outcome == 1, single=run.q.astype("f4"), many=("item", np.arange(5, dtype="u2"))
    )
    some = some.assign_coords(phase=("time", np.array(["go", "on"] * 5 + [""])))
    back = rs.open_run(rs.save_run(some, tmp_path / "run.nc"))
    xr.testing.assert_identical(back, some)
    assert {name: each.dtype for name, each in back.variables.items()} == {
        name: each.dtype for name, each in some.variables.items()
    }
    assert [type(back.attrs[name]) for name in own] == [int, float, float, float, str, float]
    assert np.signbit(back.attrs["x"]) and back.attrs["flags"].dtype == np.int8
    for name in some.variables:
        assert back[name].values.tobytes() == some[name].values.tobytes()
    back.q.values[:] = 0.0  # an array of its own, which may be written to
    back.s.values[:] = 1.0
    assert (back.q == 0.0).all() and (back.error == some.error).all()


def test_any_tool_reads_a_sealed_file(run, path):
    with xr.open_dataset(path, engine="h5netcdf") as data:
        assert data.equals(run) and data.attrs["title"] == "RobSim run"
    with h5py.File(path) as file:
        np.testing.assert_array_equal(file["q"][:], run.q)
        assert file["q"].dims[0][0] == file["time"] and file["time"].is_scale
        assert file["feature"].is_scale  # a dimension without a coordinate


def test_other_tools_read_names_shared_with_dimensions_and_empty_variables(run, tmp_path):
    odd = run.assign(
        none=("nothing", np.zeros(0)),
        mark=("third", np.arange(3.0)),  # no coordinate of the dimension mark
        flag=("time", run.time.values > 0.1),
        words=(("third", "axis"), np.array([["a", "é"]] * 3)),
    )
    path = rs.save_run(odd, tmp_path / "odd.nc")
    with xr.open_dataset(path, engine="h5netcdf") as data:
        assert data.load().drop_encoding().identical(odd)
    assert rs.open_run(path).identical(odd)


def test_a_sealed_file_is_read_without_hdf5(run, path, monkeypatch):
    for name in ("h5py", "h5netcdf"):
        monkeypatch.setitem(sys.modules, name, None)
    assert rs.open_run(path).identical(run)


def test_the_same_run_gives_the_same_file(run, path):
    assert rs.save_run(run, "again.nc").read_bytes() == path.read_bytes()


@pytest.mark.parametrize(
    "odd",
    [
        {"when": ("time", np.arange(11).astype("datetime64[s]"))},
        {"odd": ("time", np.arange(11) * 1j)},
        {"a/b": ("time", np.arange(11))},
        {"mixed": ("time", np.arange(11), {"parts": ["a", 1]})},
        {"outcome": 77},
        {"q": ("time", np.zeros(11))},
    ],
)
def test_a_run_that_could_not_be_opened_is_not_saved(run, odd, tmp_path):
    with pytest.raises(rs.errors.FileError, match="cannot write"):
        rs.save_run(run.assign(odd), tmp_path / "run.nc")
    assert not list(tmp_path.iterdir())


# ---- changed files ----


@pytest.mark.parametrize("name", ["q", "outcome", "end_time"])
def test_an_edited_number_is_reported(path, name):
    _, index = parts(path)
    changed = bytearray(path.read_bytes())
    changed[entry(index, name)["offset"]] ^= 1
    path.write_bytes(changed)
    with pytest.raises(rs.errors.FileError, match=r"run\.nc was changed: .*unsealed=True"):
        rs.open_run(path)


@pytest.mark.parametrize("name", ["scenario", "robsim"])
def test_an_edited_text_is_reported(run, path, name):
    text = run.attrs[name].encode()[-5:]
    path.write_bytes(path.read_bytes().replace(text, text[:-1] + b"9"))
    with pytest.raises(rs.errors.FileError, match=r"run\.nc was changed"):
        rs.open_run(path)


def test_no_flipped_bit_opens(path):
    whole = path.read_bytes()
    for at in np.linspace(0, len(whole) - 1, 200, dtype=int):
        changed = bytearray(whole)
        changed[at] ^= 1 << (at % 8)
        path.write_bytes(changed)
        with pytest.raises(rs.errors.FileError, match=r"was changed|has no seal"):
            rs.open_run(path)


@pytest.mark.parametrize(
    "change",
    [
        {"shape": [10**12]},
        {"shape": [1 << 61, 1 << 61]},
        {"shape": [-1, 7]},
        {"offset": -8},
        {"offset": 10**9},
        {"offset": 0.5},
        {"dtype": "|O"},
        {"dtype": ["<f8"]},
        {"dtype": "text", "texts": [["", 1 << 60]]},
        {"dims": ["time"] * 17},
        {"dims": ["time", "../coordinate"]},
        {"name": "qd"},
        {"attributes": {"units": {"dtype": "|O", "values": [1]}}},
        {"more": 1},
    ],
)
def test_a_forged_index_is_refused_whatever_its_seal(path, change):
    content, index = parts(path)
    entry(index, "q").update(change)
    path.write_bytes(sealed(content, index))
    with pytest.raises(rs.errors.FileError, match="has a seal that does not describe a run"):
        rs.open_run(path)


@pytest.mark.parametrize(
    "text", [b"[" * 10**6, b'{"a": 1, "a": 2}', b"\xff", b'"\\ud800"', b"9" * 5000, b""]
)
def test_an_index_that_is_no_plain_json_is_refused(path, text):
    path.write_bytes(sealed(parts(path)[0], text))
    with pytest.raises(rs.errors.FileError, match="has a seal with an index that is not JSON"):
        rs.open_run(path)


@pytest.mark.parametrize(
    ("name", "value", "told"),
    [
        ("title", "RobSim comparison", "its title is"),
        ("dt", -0.1, "attribute dt is -0.1"),
        ("duration", float("inf"), "attribute duration is inf"),
        ("scenario", 7, "attribute scenario is 7"),
        ("image_size", [1, 2, 3], "attribute image_size is"),
    ],
)
def test_a_sealed_file_must_be_a_run(path, name, value, told):
    content, index = parts(path)
    index["attributes"][name] = value
    path.write_bytes(sealed(content, index))
    message = f"is not a run that RobSim saved: {told}|does not describe a run"
    with pytest.raises(rs.errors.FileError, match=message):
        rs.open_run(path)


def test_an_outcome_must_be_one(path):
    content, index = parts(path)
    changed = bytearray(content)
    changed[entry(index, "outcome")["offset"]] = 77
    path.write_bytes(sealed(bytes(changed), index))
    with pytest.raises(rs.errors.FileError, match="an outcome has no name"):
        rs.open_run(path)


# ---- files without a seal ----


def external(file):
    file.create_dataset("q", (15,), "i1", external=[("secret", 0, h5py.h5f.UNLIMITED)])


def linked(file):
    file["q"] = h5py.ExternalLink("other.nc", "x")


def virtual(file):
    layout = h5py.VirtualLayout((15,), "i1")
    layout[:] = h5py.VirtualSource("other.nc", "x", (15,))
    file.create_virtual_dataset("q", layout)


def packed(file):
    file.create_dataset("q", (1 << 24,), "f8", chunks=(1 << 20,), compression="gzip")


def huge(file):
    file.create_dataset("q", (10**12,), "f8")


def soft(file):
    file["q"] = h5py.SoftLink("/q")


def group(file):
    file.create_group("q")


@pytest.mark.parametrize(
    ("harm", "told"),
    [
        (external, "q is in another file"),
        (linked, "q is a link"),
        (virtual, "q is in another file"),
        (packed, "q is compressed"),
        (huge, "its variables are larger than the file"),
        (soft, "q is a link"),
        (group, "q is not a variable"),
    ],
)
@pytest.mark.few(1)
def test_hdf5_that_reaches_further_than_its_file_is_refused_in_any_case(path, harm, told):
    Path("secret").write_bytes(SECRET)
    with h5py.File("other.nc", "w") as other:
        other["x"] = np.frombuffer(SECRET, "i1")
    path.write_bytes(parts(path)[0])
    with h5py.File(path, "a") as file:
        del file["q"]
        harm(file)
    with pytest.raises(rs.errors.FileError, match=r"run\.nc has no seal.*unsealed=True"):
        rs.open_run(path)
    with pytest.raises(rs.errors.FileError, match=f"cannot be read as a run: {told}"):
        rs.open_run(path, unsealed=True)


@pytest.mark.full
def test_a_file_without_a_seal_opens_by_an_explicit_word_only(run, path, called):
    run = run.assign(nothing=("none", np.zeros(0)))
    run.to_netcdf(path, engine="h5netcdf")  # as earlier versions wrote it
    with pytest.raises(rs.errors.FileError, match=r"run\.nc has no seal: .*--unsealed"):
        rs.open_run(path)
    assert rs.open_run(path, unsealed=True).identical(run)
    status, _, message = called("explain", path)
    assert status == 2 and "--unsealed" in message
    assert called("explain", path, "--unsealed")[0] == 0


def test_a_file_that_hdf5_cannot_read_is_reported(path):
    path.write_bytes(parts(path)[0][:3000])
    with pytest.raises(rs.errors.FileError, match=r"run\.nc cannot be read as a run"):
        rs.open_run(path, unsealed=True)
    path.write_text("no run")
    with pytest.raises(rs.errors.FileError, match=r"run\.nc is not a NetCDF-4 file"):
        rs.open_run(path, unsealed=True)


# ---- results of a replay ----


def test_a_replay_of_an_edited_run_tells_the_first_difference(run):
    edited = run.copy(deep=True)
    edited.q.values[3:5, 1] += 0.5
    was, now = edited.q.values[3, 1], run.q.values[3, 1]
    message = re.escape(f"q[body.y] at {run.time.values[3]} s is {now} now and was {was}")
    with pytest.warns(
        rs.errors.ReplayWarning, match=f"{message}; 2 of {run.q.size} values differ, in q;"
    ):
        again = rs.replay(edited)
    xr.testing.assert_identical(again, run)
    with pytest.raises(rs.errors.InputError, match=f"this run is not reproduced: {message}"):
        rs.explain(edited)


def test_a_difference_in_a_batch_names_the_run():
    batch = rs.load_scenario(rs.examples.path("visp_tutorial"))
    batch = batch.with_(start=[batch.start] * 3, duration=0.2).run()
    batch.outcome.values[2] = rs.Outcome.CONVERGED
    with pytest.warns(
        rs.errors.ReplayWarning, match="outcome of run 2 is 9 now and was 1; 1 of 3 values differ"
    ):
        rs.replay(batch)


def test_a_difference_under_another_version_names_the_versions(run):
    edited = run.assign_attrs(robsim="0.0.9").assign(q_end=run.q_end + 1e-9)
    with pytest.warns(
        rs.errors.ReplayWarning, match=r"q_end\[.*it was made with robsim 0\.0\.9 \(now "
    ):
        rs.replay(edited)


def test_instants_that_are_none_are_reported(run):
    with pytest.warns(rs.errors.ReplayWarning, match="3 of its instants are missing now"):
        rs.replay(run.assign_coords(time=run.time + np.arange(11) // 8 * 1e-3))


def test_a_selection_or_a_summary_replays_silently(run):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        rs.replay(run.isel(time=slice(0, 4)))
        rs.replay(rs.load_scenario(rs.examples.path("visp_tutorial")).run(record="summary"))


# ---- disks and processes ----


def test_drafts_of_processes_that_were_killed_go(run, tmp_path):
    dead = tmp_path / f".robsim-4194999-{'0' * 32}"
    alive = tmp_path / f".robsim-{os.getppid()}-{'0' * 32}"
    dead.touch(), alive.touch()
    rs.save_run(run, tmp_path / "run.nc")
    assert sorted(each.name for each in tmp_path.iterdir()) == sorted([alive.name, "run.nc"])
