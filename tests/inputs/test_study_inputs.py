"""Invalid studies: one clear error each, before anything runs."""

import json
import re
import socket
import sys

import flying
import numpy as np
import pytest

import robsim as rs
from robsim.studies import dask_cluster, study_store
from robsim.studies.dask_cluster import connect_client

TEXT = flying.TEXT.replace("4 s", "0.2 s")
FLYING = rs.Experiment.from_text(TEXT)
GAIN = {"task.gain": rs.samplers.Uniform(1, 2)}
BAD = {
    "runs must be a whole number from 1 on, got 0": {"runs": 0},
    "runs must be a whole number from 1 on, got -3": {"runs": -3},
    "runs must be a whole number from 1 on, got 2.5": {"runs": 2.5},
    "runs: expected a whole number": {"runs": None},
    "runs need about 1.2e.05 GB of memory, and .* GB are free: .* a store": {"runs": 10**12},
    "runs must be below": {"runs": 10**13},
    "vary: task.gian: expected": {"vary": {"task.gian": 3}},
    "task.gian: .*did you mean 'gain'": {"vary": {"task.gian": rs.samplers.Uniform(1, 2)}},
    "vary: expected {name: sampler or list}, got \\[1\\]": {"vary": [1]},
    "vary: expected dotted names .* got 3": {"vary": {3: rs.samplers.Uniform(1, 2)}},
    "vary: task.gain: expected a sampler .* got <class": {
        "vary": {"task.gain": rs.samplers.Uniform}
    },
    "vary: task.gain: expected a list of 1 to 10000 values, got \\[\\]": {
        "vary": {"task.gain": []}
    },
    "vary: task.gain: 2.0 occurs twice": {"vary": {"task.gain": [2.0, 2.0]}},
    "vary: task.gain: nan is not finite": {"vary": {"task.gain": [np.nan]}},
    "task.kind": {"vary": {"task.kind": rs.samplers.Uniform(1, 2)}},
    "gain": {"vary": {"task.gain": rs.samplers.Uniform(-2, -1)}},
    "vary: run.seed: the study sets it for each run": {"vary": {"run.seed": [1, 2]}},
    "vary: start: starts are given by start=": {"vary": {"start": [1, 2]}},
    "vary: task.law and task.law.length: one is a part": {
        "vary": {
            "task.law": [rs.laws.CameraLaw(length=0.1)],
            "task.law.length": rs.samplers.Uniform(0.1, 0.2),
        }
    },
    "start: expected starts .* got <class": {"start": rs.starts.LookAt},
    "start: expected starts .* got Normal": {"start": rs.samplers.Normal(0, 1)},
    "start: none of 5000 random starts is accepted: of 200 samples, 200 are within reach of the "
    "robot that carries 'eye' and 0 see their target; try another distance or angle, a larger": {
        "start": rs.starts.Shell(distance=(5, 6), about=rs.Pose.at(50, 0, 0))
    },
    "no object 'plate' in the scene; objects: square": {
        "start": rs.starts.LookAt("plate", distance=(1, 2))
    },
    "Anywhere.low: expected 7 finite coordinates": {"start": rs.starts.Anywhere()},
    "vary: study.runs: no run depends on it": {"vary": {"study.runs": [1, 2]}},
    "vary: title: no run depends on it": {"vary": {"title": ["a", "b"]}},
    "vary: cameras.eye.rpy and cameras.eye.rotvec: both describe the same": {
        "vary": {
            "cameras.eye.rpy": rs.samplers.Uniform([0, 0, 0], [0, 0, 1]),
            "cameras.eye.rotvec": rs.samplers.Uniform([0, 0, 0], [0, 0, 1]),
        }
    },
    "vary: cameras.eye.focal: 0.9 looks like a factor, and focal lengths are in pixels: 450; "
    "random factors are rs.samplers.Product": {"vary": {"cameras.eye.focal": [0.9, 1.1]}},
    "vary: belief.cameras.eye.focal: .* looks like a factor, and focal lengths are in pixels": {
        "vary": {"belief.cameras.eye.focal": rs.samplers.Normal(1.0, 0.05)}
    },
    "vary: task.gain: Product changes the value of the experiment, which task replaces": {
        "vary": {
            "task": [rs.IBVS(), rs.PBVS()],
            "task.gain": rs.samplers.Product(rs.samplers.Uniform(1, 2)),
        }
    },
    "vary: task: IBVS.* has a belief of its own": {
        "vary": {"task": [rs.IBVS(belief=FLYING.scene.believe(focal=1.2)), rs.IBVS()]}
    },
    "vary: cameras.eye.center: .* does not have the shape of the varied": {
        "vary": {"cameras.eye.center": rs.samplers.Sum(rs.samplers.Uniform([0, 0, 0], [1, 1, 1]))}
    },
    "threads must be a whole number from 1 on": {"threads": 0},
    "chunk must be a whole number from 1 on, got 0": {"chunk": 0},
    "resume: give the folder of the study": {"resume": True},
    "trajectories: they need a store": {"trajectories": 1},
    "client: expected a client of dask.distributed, got 3": {"client": 3},
    "store: expected a folder, got 3": {"store": 3},
}


@pytest.mark.parametrize("wanted", BAD)
def test_an_invalid_study_is_refused(wanted):
    given = {"runs": 5, **BAD[wanted]}
    with pytest.raises(rs.errors.InputError, match=wanted):
        rs.study(FLYING, **given)


def test_a_name_is_checked_before_any_value_is_drawn():
    class Uncalled:
        shape = ()

        def sample_values(self, draws, shape):
            raise AssertionError("a value was drawn")

    with pytest.raises(rs.errors.InputError) as error:
        rs.study(FLYING, 5, vary={"task.gian": Uncalled()})
    assert str(error.value).startswith("vary: task.gian: unknown key 'gian'; did you mean 'gain'?")


def test_starts_and_runs_must_agree():
    with pytest.raises(rs.errors.InputError, match="runs: 5, but 2 starts are given"):
        rs.study(FLYING, 5, start=np.tile(FLYING.scene.home, (2, 1)))


def test_a_mission_and_other_things_are_no_experiments():
    mission = rs.load_scenario(rs.examples.path("inspection_a"))
    with pytest.raises(rs.errors.InputError, match="a mission has no single end"):
        rs.study(mission, 3)
    with pytest.raises(rs.errors.InputError, match="experiment: expected an Experiment, got 3"):
        rs.study(3, 3)
    with pytest.raises(rs.errors.InputError, match="give them in vary="):
        rs.study(FLYING.vary({"task.gain": [1.0, 2.0]}), 3)


WRONG = {
    "Uniform: low 2.0 is above high 1.0": lambda: rs.samplers.Uniform(2, 1),
    "LogUniform: low 2.0 is above high 1.0": lambda: rs.samplers.LogUniform(2, 1),
    "LogUniform.low must be a positive number": lambda: rs.samplers.LogUniform(0, 1),
    "Normal.std must be a number not below 0, or a list of these, got -1": lambda: (
        rs.samplers.Normal(0, -1)
    ),
    "Uniform.low.*finite": lambda: rs.samplers.Uniform(np.nan, 1),
    "Uniform.low: expected.*'a'": lambda: rs.samplers.Uniform("a", 1),
    "Grid: expected one number for low": lambda: rs.samplers.Grid([1, 2], 3),
    "Grid: with log, expected low above 0": lambda: rs.samplers.Grid(0, 3, log=True),
    "Grid.count must be a whole number from 1": lambda: rs.samplers.Grid(1, 3, 0),
    "Sum.of.* got 3": lambda: rs.samplers.Sum(3),
    "Product: expected a sampler of numbers, got Sum": lambda: rs.samplers.Product(
        rs.samplers.Sum(rs.samplers.Uniform(0, 1))
    ),
    "Choice.values: expected a list": lambda: rs.samplers.Choice(3),
    "LookAt.distance .*expected \\(low, high\\)": lambda: rs.starts.LookAt(distance=(2, 1)),
    "LookAt.roll": lambda: rs.starts.LookAt(distance=(1, 2), roll=(1, -1)),
    "LookAt.distance": lambda: rs.starts.LookAt(distance=3),
    "Shell.angle: at most pi": lambda: rs.starts.Shell(distance=(0, 1), angle=(0, 4)),
    "About.position": lambda: rs.starts.About(position=[1, 2]),
}


@pytest.mark.parametrize("wanted", WRONG)
def test_an_invalid_sampler_is_refused(wanted):
    with pytest.raises(rs.errors.InputError, match=wanted):
        WRONG[wanted]()


def test_a_number_that_is_drawn_and_not_valid_is_refused_before_anything_runs():
    with pytest.raises(
        rs.errors.InputError, match=r"vary: task.gain: sampled value -?\d.*: .*task.gain"
    ):
        rs.study(FLYING, 1000, vary={"task.gain": rs.samplers.Normal(1.0, 1.0)})


def test_a_store_of_another_study_is_not_touched(tmp_path):
    rs.study(FLYING, 5, store=tmp_path, vary=GAIN)
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    for resume in (False, True):
        with pytest.raises(rs.errors.FileError, match="holds another study; choose another folder"):
            rs.study(FLYING, 6, store=tmp_path, vary=GAIN, resume=resume)
    assert before == {path.name: path.read_bytes() for path in tmp_path.iterdir()}


@pytest.mark.parametrize(
    ("change", "wanted"),
    [
        ({"format": 3, "robsim": "9.9.9"}, "a study of format 3, of RobSim 9.9.9; this is"),
        ({"format": 1}, "a study of format 1, of RobSim .*; this is"),
        ({"format": "x"}, "not in the form that RobSim writes"),
        ({"kernels": "0"}, "study.toml or study.json was changed after the study began"),
    ],
)
def test_a_store_of_another_version_is_reported(tmp_path, change, wanted):
    rs.study(FLYING, 5, store=tmp_path, vary=GAIN)
    about = tmp_path / "study.json"
    about.write_text(json.dumps({**json.loads(about.read_text()), **change}))
    with pytest.raises(rs.errors.FileError, match=wanted):
        rs.open_study(tmp_path)


def test_rows_of_another_version_are_read_and_none_is_added(tmp_path, monkeypatch):
    monkeypatch.setattr(study_store, "VERSIONS", {"robsim": "0.0.1", "kernels": "0"})
    made = rs.study(FLYING, 5, store=tmp_path, vary=GAIN)
    monkeypatch.undo()
    assert rs.open_study(tmp_path).hash == made.hash
    with pytest.raises(rs.errors.FileError, match="was begun with other versions"):
        rs.study(FLYING, 5, store=tmp_path, vary=GAIN, resume=True)


def test_a_damaged_part_is_named_and_simulated_again(tmp_path):
    made = rs.study(FLYING, 5, store=tmp_path, vary=GAIN)
    (part,) = tmp_path.glob("rows-*")
    whole = part.read_bytes()
    flipped = [whole[:i] + bytes([whole[i] ^ 1]) + whole[i + 1 :] for i in (4, 700, len(whole) - 9)]
    for data in (b"", whole[: len(whole) // 2], *flipped):
        part.write_bytes(data)
        with pytest.raises(rs.errors.FileError, match=f"{part} is damaged, or of another study"):
            _ = rs.open_study(tmp_path).runs
        with pytest.raises(rs.errors.FileError, match=f"{part} is damaged"):
            rs.study(FLYING, 5, store=tmp_path, vary=GAIN, resume=True)
    part.unlink()
    assert not rs.open_study(tmp_path).complete
    assert rs.study(FLYING, 5, store=tmp_path, vary=GAIN, resume=True).hash == made.hash
    assert part.read_bytes() == whole


def test_rows_of_another_seed_are_of_another_study(tmp_path):
    for seed in (1, 2):
        rs.study(FLYING, 5, store=tmp_path / str(seed), vary=GAIN, seed=seed)
    (own,), (other,) = (list((tmp_path / name).glob("rows-*")) for name in "12")
    own.unlink()
    other.rename(own.with_name(other.name))
    with pytest.raises(rs.errors.FileError, match="of another study"):
        _ = rs.open_study(tmp_path / "1").table


@pytest.mark.parametrize("store", ["new", "new/inner", "old"])
@pytest.mark.few(1)
def test_an_error_leaves_no_new_folder(tmp_path, monkeypatch, store):
    (tmp_path / "old").mkdir()
    far = rs.starts.Shell(distance=(5, 6), about=rs.Pose.at(50, 0, 0))
    with pytest.raises(rs.errors.InputError, match="none of 5000 random starts"):
        rs.study(FLYING, 5, start=far, store=tmp_path / store)
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(rs.errors.InputError, match=r"need PyArrow: pip install 'robsim.store.'"):
        rs.study(FLYING, 5, store=tmp_path / store)
    assert (tmp_path / "old").is_dir() and not (tmp_path / "new" / "inner").exists()
    assert store != "new" or not (tmp_path / "new").exists()


def test_an_edited_text_is_no_text_of_the_study(tmp_path):
    made = rs.study(FLYING, 5, vary=GAIN, seed=1)
    rs.study(FLYING, 5, store=tmp_path, vary=GAIN, seed=1)
    text = (tmp_path / "study.toml").read_text()
    for old, new in (
        ("seed = 1", "seed = 2"),
        ("high = 2.0", "high = 4.0"),
        ("runs = 5", "runs = 6"),
    ):
        assert old in text
        (tmp_path / "study.toml").write_text(text.replace(old, new))
        with pytest.raises(rs.errors.FileError, match=r"study.toml or study.json was changed"):
            rs.open_study(tmp_path)
    other = rs.study(FLYING, 5, vary={"task.gain": rs.samplers.Uniform(1.0, 4.0)}, seed=1)
    same = rs.studies.StudyResult(other.plan, lambda: (made.runs, made._facts[1]))
    assert made.hash != same.hash


def test_the_hash_does_not_depend_on_a_store(tmp_path):
    options = {"vary": GAIN, "seed": 3}
    kept = rs.study(FLYING, 5, store=tmp_path, trajectories=1, **options)
    assert rs.study(FLYING, 5, **options).hash == kept.hash == rs.open_study(tmp_path).hash
    runs, facts = kept._facts
    hashes = {
        rs.studies.StudyResult(kept.plan, lambda x=x: (runs, {**facts, "error_norm": x})).hash
        for x in (np.full(5, np.nan), np.full(5, -np.nan))  # of the other sign
    }
    assert len(hashes) == 1 and kept.hash not in hashes


def test_a_scheduler_that_does_not_answer_is_reported_soon(monkeypatch):
    assert dask_cluster.PATIENCE < 15
    monkeypatch.setattr(dask_cluster, "PATIENCE", 0.5)
    silent = socket.create_server(("127.0.0.1", 0))
    address = f"tcp://127.0.0.1:{silent.getsockname()[1]}"
    with silent, pytest.raises(rs.errors.InputError, match=f"no scheduler answers at {address}"):
        connect_client(address)
    with pytest.raises(rs.errors.InputError, match="expected an address such as tcp://host:8786"):
        connect_client("host")


def test_commands_report_an_invalid_study(called, tmp_path):
    path = tmp_path / "s.toml"
    path.write_text(TEXT)
    _, _, err = called("study", path)
    assert "there is no table [study], as in" in err
    path.write_text(TEXT + '[study]\nruns = 5\nvary = { "task.gain" = { kind = "unifrom" } }')
    status, _, err = called("study", path, "-o", tmp_path / "out")
    assert status == 2 and "task.gain" in err and not (tmp_path / "out").exists()
    path.write_text(TEXT + "[study]\nruns = 5\nvry = 3")
    status, _, err = called("study", path)
    assert status == 2 and re.search("study.vry: unknown key.*did you mean 'vary'", err)
    path.write_text(
        TEXT + '[study]\nruns = 5\nstart = { kind = "look_at", distance = ["1 m", "2 m"] }'
    )
    status, out, err = called("study", path, "-o", tmp_path / "out")
    assert status == 0 and "5 runs: 5 draws; drawn: start" in out
    status, _, err = called("study", path, "--resume")
    assert status == 2 and "nothing to resume" in err


def test_names_without_quotes_are_taken_as_meant(tmp_path):
    from robsim.studies.study_text import read_plan

    path = tmp_path / "s.toml"
    path.write_text(
        TEXT + '[study]\nruns = 5\nvary.task.gain = { kind = "uniform", low = 1, high = 2 }'
    )
    assert read_plan(rs.load_scenario(path)).axes[0].name == "task.gain"
    assert read_plan(rs.load_scenario(path, ["study.runs=7"])).draws == 7
    start = '{ kind = "look_at", distance = ["1 m", "2 m"], roll = ["-1 deg", "120 deg"] }'
    roll = read_plan(rs.load_scenario(path, [f"study.start={start}"])).start.roll
    np.testing.assert_allclose(roll, np.radians([-1, 120]))
