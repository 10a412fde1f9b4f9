"""Meshes of files that are gone, have moved or have changed since a run; read by trimesh."""

import pickle
import shutil
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from pictures.test_stored_pictures import write_scenario

import robsim as rs
from robsim.vision import DotPattern

BALL = trimesh.creation.icosphere(subdivisions=3, radius=0.1)
BOX = trimesh.creation.box((0.2, 0.2, 0.2))
URDF = """<robot name="free"><link name="base"/><link name="body"><visual><origin xyz="{place}"/>
<geometry><mesh filename="stone.stl"/></geometry></visual></link>
<joint name="free" type="floating"><parent link="base"/><child link="body"/></joint></robot>"""
MESH = '{ kind = "mesh", filename = "stone.stl"%s }'
POSTER = '{ kind = "poster", picture = "cat.png", width = "60 cm" }'


def write_cell(folder, mesh=BALL, content=""):
    """Write a scenario with a mesh on its wall, and return its path."""
    path = write_scenario(folder)
    mesh.export(folder / "stone.stl")
    path.write_text(path.read_text().replace(POSTER, MESH % content))
    return path


@pytest.fixture
def flight(tmp_path):
    """Return a camera on a robot with a mesh, which it sees beside the dots that it detects."""
    folder = tmp_path / "here"
    folder.mkdir()
    BALL.export(folder / "stone.stl")
    (folder / "free.urdf").write_text(URDF.format(place="0.5 0 1"))
    robot = rs.Robot.from_urdf(folder / "free.urdf")
    lens = rs.Camera([[120, 0, 47.5], [0, 120, 47.5], [0, 0, 1]], (128, 96))
    eye = rs.MountedCamera("eye", lens, on="free.body")
    dots = DotPattern([[-0.1, -0.1], [0.1, -0.1], [0.1, 0.1], [-0.1, 0.1]], radius=0.03)
    target = rs.Object("dots", dots=dots, pose=rs.Pose.at(0, 0, 1))
    start = [0.02, 0.01, -0.05, 0, 0, 0, 1]
    task = rs.IBVS(target="dots", detector="dots")
    return rs.Experiment(rs.Scene(robot, target, eye), task, start, duration=0.4)


def test_a_run_in_another_folder_without_the_file_has_the_pictures_of_the_first(
    flight, tmp_path, monkeypatch
):
    run = flight.run()
    rs.save_run(run, tmp_path / "there.nc")
    shutil.rmtree(tmp_path / "here")
    (tmp_path / "other").mkdir()
    monkeypatch.chdir(tmp_path / "other")
    stored = rs.open_run(tmp_path / "there.nc")
    repeated = rs.replay(stored)
    np.testing.assert_array_equal(repeated.picture_hash.values, run.picture_hash.values)
    assert repeated.identical(stored)
    rebuilt = rs.Experiment.of(stored)
    assert rebuilt == flight and rebuilt.hash == flight.hash
    np.testing.assert_array_equal(rebuilt.scene.picture(), flight.scene.picture())
    bare = replace(flight.scene.robot().links[1], shapes=())
    links = (flight.scene.robot().links[0], bare)
    scene = flight.scene.replacing(replace(flight.scene.robot(), links=links))
    assert (scene.picture() != flight.scene.picture()).any()


def test_a_scenario_names_the_file_of_a_mesh(tmp_path):
    cell = rs.load_scenario(write_cell(tmp_path / "here"))
    picture = cell.scene.picture()
    assert (picture != 50).sum() > 100
    assert cell.to_toml(folder=tmp_path / "here").count("sha256") == 0
    assert cell.write_stored_data(tmp_path / "here") == []
    (digest,) = cell.stored_data
    assert (
        rs.load_scenario(
            write_cell(tmp_path / "pinned", content=f', content = {{ sha256 = "{digest}" }}')
        )
        == cell
    )
    (tmp_path / "there").mkdir()
    assert [path.suffix for path in cell.write_stored_data(tmp_path / "there")] == [".mesh"]
    (tmp_path / "there/cell.toml").write_text(cell.to_toml(folder=tmp_path / "there"))
    shutil.rmtree(tmp_path / "here")
    moved = rs.load_scenario(tmp_path / "there/cell.toml")
    assert moved == cell and moved.hash == cell.hash
    np.testing.assert_array_equal(moved.scene.picture(), picture)


def test_a_mesh_that_has_changed_since_is_an_error_with_both_hashes(tmp_path):
    digests = [
        next(iter(rs.load_scenario(write_cell(tmp_path / "cell", mesh)).stored_data))
        for mesh in (BOX, BALL)
    ]
    content = f', content = {{ sha256 = "{digests[0]}" }}'
    with pytest.raises(rs.errors.FileError) as error:
        rs.load_scenario(write_cell(tmp_path / "cell", BALL, content))
    text = f"the mesh has changed: expected sha256 {digests[0][:12]}..., got {digests[1][:12]}..."
    assert text in str(error.value)
    (tmp_path / "cell/stone.stl").write_bytes(b"")
    with pytest.raises(rs.errors.FileError, match=r"shapes\[0\].content: stone.stl: "):
        rs.load_scenario(tmp_path / "cell/cell.toml")


def test_a_file_that_changes_after_it_was_read_does_not_change_the_experiment(tmp_path):
    cell = rs.load_scenario(write_cell(tmp_path))
    run, picture = cell.run(record="summary"), cell.scene.picture()
    BOX.export(tmp_path / "stone.stl")
    np.testing.assert_array_equal(cell.scene.picture(), picture)
    np.testing.assert_array_equal(rs.Experiment.of(run).scene.picture(), picture)
    assert "sha256" in cell.to_toml(folder=tmp_path)
    assert rs.load_scenario(tmp_path / "cell.toml") != cell


def test_a_change_of_the_name_takes_the_other_file(tmp_path):
    cell = rs.load_scenario(write_cell(tmp_path))
    BOX.export(tmp_path / "box.stl")
    shape = "objects.wall.shapes"
    other = cell.at(shape, [{"kind": "mesh", "filename": "box.stl"}])
    assert (other.scene.picture() != cell.scene.picture()).any()


def test_another_process_needs_no_file(tmp_path):
    data = pickle.dumps(rs.load_scenario(write_cell(tmp_path / "cell")))
    shutil.rmtree(tmp_path / "cell")
    assert (pickle.loads(data).scene.picture() != 50).sum() > 100


def test_a_mesh_that_cannot_be_read_is_stored_by_its_name(tmp_path):
    cell = rs.load_scenario(write_cell(tmp_path))
    (tmp_path / "stone.stl").write_bytes(b"solid nothing")
    run = cell.run(record="summary")
    assert "stored_data" not in run.attrs and "sha256" not in run.attrs["scenario"]
    assert rs.Experiment.of(run).scene == cell.scene
    with pytest.warns(rs.errors.FileWarning, match="'stone.stl': no triangles"):
        cell.scene.picture()
