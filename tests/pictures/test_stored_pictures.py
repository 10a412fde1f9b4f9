"""Pictures in scenario files, runs and studies: texts name them, and the data is stored once."""

import base64
import hashlib
import json
import pickle
import shutil
from dataclasses import replace

import numpy as np
import pytest

import robsim as rs
from robsim.shapes import Block, GreyPicture, Poster

SCENARIO = """
schema = 1
robots = [{{ model = "free_camera" }}]
cameras = [{{ name = "eye", on = "free_camera.body", focal = 80, size = [96, 72] }}]
task = {{ kind = "ibvs", target = "dots" }}
start = {{ q = ["2 cm", "1 cm", "-10 cm", 0, 0, 0, 1] }}
run = {{ duration = "0.4 s" }}

[[objects]]
name = "dots"
marks = ["0, 0, 1 m", "10, 0, 100 cm", "0, 10, 100 cm", "10, 10, 100 cm"]

[[objects]]
name = "wall"
marks = []
position = "0, 0, 1.2 m"
shapes = [{{ kind = "poster", picture = {picture}, width = "60 cm" }}]
"""


def draw_noise(seed=0, shape=(30, 40)):
    return np.random.default_rng(seed).integers(0, 256, shape, dtype=np.uint8)


def write_scenario(folder, picture='"cat.png"', grey=None):
    """Write a scenario file with a picture beside it, and return its path."""
    from PIL import Image

    folder.mkdir(exist_ok=True)
    Image.fromarray(draw_noise() if grey is None else grey).save(folder / "cat.png")
    path = folder / "cell.toml"
    path.write_text(SCENARIO.format(picture=picture))
    return path


def hang_up(experiment, *shapes):
    """Return the experiment with other shapes on its wall."""
    *others, wall = experiment.scene.objects
    objects = (*others, replace(wall, shapes=shapes))
    return experiment.with_(scene=replace(experiment.scene, objects=objects))


def test_the_digest_is_that_of_the_picture_as_a_file_of_netpbm():
    grey = draw_noise()
    content = b"P5\n40 30\n255\n" + grey.tobytes()
    assert GreyPicture(grey).digest == hashlib.sha256(content).hexdigest()


def test_a_text_names_the_file_of_a_picture(tmp_path):
    cell = rs.load_scenario(write_scenario(tmp_path))
    (poster,) = cell.scene.object("wall").shapes
    assert poster.picture == GreyPicture(draw_noise())
    assert 'picture = "cat.png"' in cell.to_toml(folder=tmp_path)
    digest = poster.picture.digest
    pinned = rs.load_scenario(
        write_scenario(tmp_path, f'{{ file = "cat.png", sha256 = "{digest}" }}')
    )
    assert pinned == cell
    assert pinned.hash == cell.hash == hang_up(cell, Poster(draw_noise(), 0.6)).hash


def test_a_stored_run_needs_no_file_of_its_pictures(tmp_path):
    cell = rs.load_scenario(write_scenario(tmp_path / "here"))
    before = cell.scene.picture(samples=2, exact=True)
    run = cell.run()
    path = rs.save_run(run, tmp_path / "run.nc")
    shutil.rmtree(tmp_path / "here")
    again = rs.open_run(path)
    rebuilt = rs.Experiment.of(again)
    assert rebuilt == cell
    np.testing.assert_array_equal(rebuilt.scene.picture(samples=2, exact=True), before)
    assert rs.replay(again).identical(again)
    assert json.loads(again.attrs["stored_data"]).keys() == {GreyPicture(draw_noise()).digest}


def test_a_picture_of_a_batch_of_runs_is_stored_once(tmp_path):
    cell = rs.load_scenario(write_scenario(tmp_path))
    batch = cell.with_(start=np.array([cell.start, cell.start]), record="summary").run()
    assert len(json.loads(batch.attrs["stored_data"])) == 1
    alone = rs.Experiment.of(batch.isel(run=slice(1, 2)))
    assert alone.scene == cell.scene and alone.first_run == 1


def test_a_process_gets_the_pictures_of_an_experiment(tmp_path):
    cell = rs.load_scenario(write_scenario(tmp_path))
    assert pickle.loads(pickle.dumps(cell)) == cell


def test_equal_pictures_are_stored_once(tmp_path):
    cell = rs.load_scenario(write_scenario(tmp_path))
    posters = [Poster(draw_noise(), width) for width in (0.2, 0.3, 0.4)]
    run = hang_up(cell, *posters, Poster(draw_noise(1), 0.2)).run()
    assert len(json.loads(run.attrs["stored_data"])) == 2
    assert "stored_data" not in hang_up(cell, Block(0.1, 0.1, 0.1)).run().attrs


def test_a_run_with_other_data_of_a_picture_is_refused(tmp_path):
    run = rs.load_scenario(write_scenario(tmp_path)).run(record="summary")
    digest = GreyPicture(draw_noise()).digest
    other = base64.b64encode(GreyPicture(draw_noise(1)).png).decode()
    for text, message in {
        json.dumps({digest: other}): f"sha256 {digest[:12]}... is stored with the data of",
        json.dumps({digest: "AAAA"}): "stored data of the run: no picture of PNG",
        json.dumps({digest: "*"}): "not in the form that RobSim writes",
        json.dumps([digest]): "not in the form that RobSim writes",
        json.dumps({}): f"the data of the picture {digest[:12]}... is missing",
    }.items():
        with pytest.raises(rs.errors.FileError) as error:
            rs.Experiment.of(run.assign_attrs(stored_data=text))
        assert message in str(error.value)


def test_pictures_that_are_too_large_for_a_run(tmp_path, monkeypatch):
    monkeypatch.setattr("robsim.run.stored_data.MOST_BYTES", 1000)
    run = rs.load_scenario(write_scenario(tmp_path)).run(record="summary")
    assert run.attrs["scenario"] == "" and "stored_data" not in run.attrs
    reason = "its pictures and meshes take 0.0 MB; a run stores at most 0 MB of them"
    with pytest.raises(rs.errors.InputError, match=f"cannot be repeated .*: {reason}"):
        rs.Experiment.of(run)


def test_a_picture_that_has_changed_since_is_an_error_with_both_hashes(tmp_path):
    digest, other = (GreyPicture(draw_noise(seed)).digest for seed in (0, 1))
    pinned = f'{{ file = "cat.png", sha256 = "{digest}" }}'
    path = write_scenario(tmp_path, pinned, draw_noise(1))
    expected = (
        f"the picture has changed: expected sha256 {digest[:12]}..., got {other[:12]}...; restore "
        "the file, or remove sha256 to take its new content"
    )
    with pytest.raises(rs.errors.FileError) as error:
        rs.load_scenario(path)
    assert "objects.wall.shapes[0].picture: " in str(error.value)
    assert expected in str(error.value)


def test_a_file_that_changes_after_it_was_read_does_not_change_the_experiment(tmp_path):
    cell = rs.load_scenario(write_scenario(tmp_path))
    write_scenario(tmp_path, grey=draw_noise(1))
    digest = GreyPicture(draw_noise()).digest
    assert f'picture = {{ sha256 = "{digest}" }}' in cell.to_toml(folder=tmp_path)
    assert rs.Experiment.of(cell.run()).scene == cell.scene


def test_pictures_without_a_file_are_written_beside_a_text(tmp_path):
    cell = rs.load_scenario(write_scenario(tmp_path))
    drawn = hang_up(cell, Poster(draw_noise(1), 0.6), Poster(tmp_path / "cat.png", 0.1))
    path = tmp_path / "drawn.toml"
    path.write_text(drawn.to_toml(folder=tmp_path))
    with pytest.raises(rs.errors.FileError, match=r"the data of the picture .* is missing"):
        rs.load_scenario(path)
    digest = GreyPicture(draw_noise(1)).digest
    assert drawn.write_stored_data(tmp_path) == [tmp_path / "pictures" / f"{digest[:16]}.png"]
    assert rs.load_scenario(path) == drawn
    assert cell.write_stored_data(tmp_path) == []
    given = [GreyPicture(draw_noise(seed)) for seed in (0, 1)]
    assert rs.Experiment.from_text(drawn.to_toml(complete=True), stored_data=given) == drawn


def test_a_change_keeps_the_pictures_of_an_experiment(tmp_path):
    cell = hang_up(rs.load_scenario(write_scenario(tmp_path)), Poster(draw_noise(1), 0.6))
    moved = cell.at({"objects.wall.position": "0, 0, 2 m", "task.gain": "2"})
    assert moved.stored_data == cell.stored_data
    assert moved.scene.object("wall").shapes == cell.scene.object("wall").shapes
    believed = cell.at("belief.objects.wall.position", "0, 0, 3 m")
    assert rs.Experiment.of(believed.run(record="summary")).task == believed.task


def test_a_study_stores_a_picture_once(tmp_path):
    cell = hang_up(rs.load_scenario(write_scenario(tmp_path / "here")), Poster(draw_noise(1), 0.6))
    vary = {"task.gain": [1.0, 2.0, 3.0]}
    rs.study(cell, 1, vary=vary, store=tmp_path / "store")
    shutil.rmtree(tmp_path / "here")
    files = sorted(path.name for path in (tmp_path / "store").rglob("*.png"))
    assert files == [f"{GreyPicture(draw_noise(1)).digest[:16]}.png"]
    stored = rs.open_study(tmp_path / "store")
    assert stored.plan.experiment.scene == cell.scene
    (tmp_path / "store" / "pictures" / files[0]).write_bytes(GreyPicture(draw_noise(2)).png)
    with pytest.raises(rs.errors.FileError, match="the picture has changed"):
        rs.open_study(tmp_path / "store")


@pytest.mark.parametrize(
    ("picture", "text"),
    [
        ("3", "must be the path of a picture, or { file"),
        ("{}", "must be the path of a picture, or { file"),
        ('{ path = "cat.png" }', "unknown key 'path'"),
        ('{ file = "" }', "file must be the path of a picture, got ''"),
        ('{ file = "cat.png", sha256 = "A" }', "sha256 must be 64 hexadecimal digits, got 'A'"),
        ('"dog.png"', "dog.png: no such file"),
        ('"cell.toml"', "no picture of PNG"),
    ],
)
def test_invalid_pictures_of_a_text(tmp_path, picture, text):
    with pytest.raises(rs.errors.FileError) as error:
        rs.load_scenario(write_scenario(tmp_path, picture))
    assert "objects.wall.shapes[0].picture: " in str(error.value)
    assert text in str(error.value)
