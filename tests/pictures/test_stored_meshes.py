"""Meshes in scenario files, runs and studies: texts name them, and the triangles are stored."""

import base64
import json
import pickle
import zlib
from dataclasses import replace

import numpy as np
import pytest
from pictures.test_stored_pictures import hang_up, write_scenario

import robsim as rs
from robsim.container import pack_container
from robsim.geometry.triangle_mesh import SIGNATURE
from robsim.shapes import Mesh, TriangleMesh
from robsim.vision import DotPattern

POINTS = np.array([[0.0, 0, 0], [0.2, 0, 0], [0, 0.2, 0], [0, 0, 0.2]])
TRIANGLES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])


def make_stone(size=1.0):
    return Mesh("stone.stl", content=(size * POINTS, TRIANGLES), albedo=0.9)


@pytest.fixture
def cell(tmp_path):
    """Return an experiment with a stone on its wall, from a scenario file."""
    return hang_up(rs.load_scenario(write_scenario(tmp_path / "cell")), make_stone())


@pytest.fixture
def flight():
    """Return a camera that detects dots with a stone before them."""
    lens = rs.Camera([[120, 0, 47.5], [0, 120, 47.5], [0, 0, 1]], (96, 96))
    eye = rs.MountedCamera("eye", lens, on="free.body")
    dots = DotPattern([[-0.1, -0.1], [0.1, -0.1], [0.1, 0.1], [-0.1, 0.1]], radius=0.03)
    target = rs.Object("dots", dots=dots, pose=rs.Pose.at(0, 0, 1))
    stone = rs.Object("stone", make_stone(), pose=rs.Pose.at(0.17, -0.1, 1))
    robot = replace(rs.robots.free_camera(), name="free")
    scene = rs.Scene(robot, [target, stone], eye)
    start = [0.02, 0.01, -0.05, 0, 0, 0, 1]
    return rs.Experiment(scene, rs.IBVS(target="dots", detector="dots"), start, duration=0.4)


def test_a_run_repeats_its_pictures_with_a_mesh_that_has_no_file(flight, tmp_path):
    run = flight.run()
    again = rs.open_run(rs.save_run(run, tmp_path / "run.nc"))
    rebuilt = rs.Experiment.of(again)
    assert rebuilt == flight and rebuilt.hash == flight.hash
    repeated = rs.replay(again)
    assert repeated.identical(again)
    np.testing.assert_array_equal(repeated.picture_hash.values, run.picture_hash.values)
    without = flight.with_(scene=replace(flight.scene, objects=flight.scene.objects[:1])).run()
    assert (without.picture_hash.values != run.picture_hash.values).all()


def test_equal_meshes_are_stored_once(cell):
    run = hang_up(cell, make_stone(), replace(make_stone(), scale=(2, 1, 1)), make_stone(2.0)).run()
    stored = [make_stone(size).content.digest for size in (1.0, 2.0)]
    assert json.loads(run.attrs["stored_data"]).keys() == set(stored)


def test_a_study_stores_a_mesh_once(cell, tmp_path):
    rs.study(cell, 1, vary={"task.gain": [1.0, 2.0, 3.0]}, store=tmp_path / "store")
    (path,) = (tmp_path / "store").rglob("*.mesh")
    assert path.name == f"{make_stone().content.digest[:16]}.mesh"
    assert rs.open_study(tmp_path / "store").plan.experiment.scene == cell.scene
    path.write_bytes(make_stone(2.0).content.packed)
    with pytest.raises(rs.errors.FileError, match="the mesh has changed"):
        rs.open_study(tmp_path / "store")


def test_meshes_without_a_file_are_written_beside_a_text(cell, tmp_path):
    path = tmp_path / "cell" / "stone.toml"
    path.write_text(cell.to_toml(folder=path.parent))
    assert f'content = {{ sha256 = "{make_stone().content.digest}" }}' in path.read_text()
    with pytest.raises(rs.errors.FileError, match=r"the data of the mesh .* is missing"):
        rs.load_scenario(path)
    (file,) = cell.write_stored_data(path.parent)
    assert file.parent == path.parent / "meshes"
    assert rs.load_scenario(path) == cell
    data = [make_stone().content]
    assert rs.Experiment.from_text(cell.to_toml(complete=True), stored_data=data) == cell


def test_a_change_keeps_the_meshes_of_an_experiment(cell):
    moved = cell.at({"objects.wall.position": "0, 0, 2 m"})
    assert moved.stored_data == cell.stored_data
    assert moved.scene.object("wall").shapes == cell.scene.object("wall").shapes
    assert pickle.loads(pickle.dumps(cell)) == cell


def test_meshes_are_equal_if_their_triangles_are():
    stone = make_stone()
    assert stone == make_stone() and hash(stone) == hash(make_stone())
    assert stone != make_stone(2.0) and stone != replace(stone, content=None)
    assert stone.content != 3 and stone.content == TriangleMesh.from_arrays(POINTS, TRIANGLES)
    assert hash(stone.content) == hash(make_stone().content)
    assert TriangleMesh.unpack(stone.content.packed, "copy") == stone.content
    part = stone.content.parts[0]
    colored = TriangleMesh((part._replace(color="#ff0000"),))
    assert colored != stone.content
    assert TriangleMesh.unpack(colored.packed, "copy").parts[0].color == "#ff0000"


@pytest.mark.parametrize(
    ("points", "triangles", "text"),
    [
        ([[0, 0, np.nan]] * 3, [[0, 1, 2]], "points"),
        ([[0, 0, 1e7]] * 3, [[0, 1, 2]], "points must be finite, at most 1e"),
        (POINTS[:, :2], TRIANGLES, "points"),
        (POINTS, np.empty((0, 3), dtype=int), "0 triangles in 1 parts; expected 1 to 1000000"),
        (POINTS, [[0, 1, 4]], "triangles refer to points that do not exist"),
        (POINTS, [[0, 1, -1]], "triangles refer to points that do not exist"),
        (POINTS, [[0, 1, 2**40]], "triangles refer to points that do not exist"),
        (POINTS, [[0, 1]], "expected triangles of integers, shape (n, 3), got int64, shape (1, 2)"),
        (POINTS, [[0.0, 1.0, 2.0]], "expected triangles of integers"),
        (POINTS, np.zeros((1_000_001, 3), dtype=np.int8), "1000001 triangles"),
    ],
)
def test_arrays_that_are_no_mesh(points, triangles, text):
    with pytest.raises(rs.errors.InputError) as error:
        Mesh("stone.stl", content=(points, triangles))
    assert text in str(error.value)


def pack(*arrays, colors=(None,)):
    content = pack_container({"colors": list(colors)}, [np.asarray(each) for each in arrays])
    return SIGNATURE + zlib.compress(content.getvalue())


EDGES = np.empty((0, 2), dtype=np.int32)
HOSTILE = {
    "bomb": SIGNATURE + zlib.compress(bytes(201_000_000), 1),
    "cut": make_stone().content.packed[:-9],
    "no container": SIGNATURE + zlib.compress(b"nothing"),
    "no compression": SIGNATURE + b"nothing",
    "indices": pack(POINTS, [[0, 1, 9]], EDGES),
    "nan": pack(POINTS * np.nan, TRIANGLES, EDGES),
    "sharp": pack(POINTS, TRIANGLES, [[0, 9]]),
    "color": pack(POINTS, TRIANGLES, EDGES, colors=["url(x)"]),
    "colors": pack(POINTS, TRIANGLES, EDGES, colors=[None, None]),
    "no triangles": pack(colors=()),
    "many parts": pack(*(POINTS, TRIANGLES, EDGES) * 9, colors=9 * [None]),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_a_run_with_other_data_of_a_mesh_is_refused(name):
    with pytest.raises(rs.errors.FileError, match="run: no mesh of RobSim: "):
        TriangleMesh.unpack(HOSTILE[name], "run")


def test_a_run_with_the_data_of_another_mesh_is_refused(cell):
    run = cell.run(record="summary")
    digest, other = (make_stone(size).content.digest for size in (1.0, 2.0))
    for data, text in {
        base64.b64encode(make_stone(2.0).content.packed).decode(): f"the data of {other[:12]}",
        base64.b64encode(HOSTILE["cut"]).decode(): "no mesh of RobSim: it is cut short",
    }.items():
        with pytest.raises(rs.errors.FileError) as error:
            rs.Experiment.of(run.assign_attrs(stored_data=json.dumps({digest: data})))
        assert text in str(error.value)
    with pytest.raises(rs.errors.FileError, match="the data of the mesh"):
        rs.Experiment.of(run.assign_attrs(stored_data="{}"))


@pytest.mark.parametrize(
    ("content", "text"),
    [
        ("3", 'must be the SHA-256 of triangles, as in { sha256 = "..." }'),
        ("{}", "must be the SHA-256 of triangles"),
        ('{ file = "stone.stl" }', "unknown key 'file'"),
        ('{ sha256 = "A" }', "sha256 must be 64 hexadecimal digits, got 'A'"),
    ],
)
def test_invalid_contents_of_a_text(tmp_path, content, text):
    path = write_scenario(tmp_path)
    mesh = f'kind = "mesh", filename = "stone.stl", content = {content}'
    lines = path.read_text().replace('kind = "poster", picture = "cat.png", width = "60 cm"', mesh)
    path.write_text(lines)
    with pytest.raises(rs.errors.FileError) as error:
        rs.load_scenario(path)
    assert "objects.wall.shapes[0].content: " in str(error.value)
    assert text in str(error.value)


@pytest.mark.parametrize(
    ("parts", "message"),
    [
        (None, "expected parts"),
        ([1], "expected parts"),
        ([(np.eye(3), [[0, 1, 2]], [], None, 0)], "expected parts"),
        ([(np.eye(3), [[0, 1, 2], [0]], np.empty((0, 2), int), None)], "expected triangles"),
        ([(np.eye(3), "abc", np.empty((0, 2), int), None)], "expected triangles"),
    ],
)
def test_parts_that_are_no_mesh_are_refused(parts, message):
    with pytest.raises(rs.errors.InputError, match=message):
        TriangleMesh(parts)
