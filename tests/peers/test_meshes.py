"""Meshes that URDF files name, as figures and pages draw them; made and read by trimesh."""

import os
import warnings

import numpy as np
import pytest
import trimesh
from hostile_meshes import HOSTILE

import robsim as rs
from robsim.geometry import mesh_files
from robsim.plot.wireframe import list_drawable_shapes, list_scene_parts

BALL = trimesh.creation.icosphere(subdivisions=3, radius=0.1)
LINK = (
    '<link name="{name}"><visual>{origin}<geometry><mesh filename="{mesh}" {scale}/></geometry>'
    "{color}</visual>{more}</link>"
)
BOX = "<collision><geometry><box size='0.2 0.2 0.2'/></geometry></collision>"


def urdf(folder, mesh, scale="", color="", more="", origin=""):
    """A robot of one link with a mesh, read from a file in folder/arm/urdf."""
    (folder / "arm/urdf").mkdir(parents=True, exist_ok=True)
    (folder / "arm/meshes").mkdir(exist_ok=True)
    link = LINK.format(name="a", mesh=mesh, scale=scale, color=color, more=more, origin=origin)
    path = folder / "arm/urdf/arm.urdf"
    path.write_text(f'<robot name="arm">{link}</robot>')
    return rs.Robot.from_urdf(path)


def list_drawn_shapes(robot):
    return list_drawable_shapes(robot.links[0].shapes)


def lack(robot):
    return robot.links[0].shapes[0].lack


@pytest.mark.parametrize("kind", ["stl", "obj", "dae", "glb"])
def test_every_format_is_drawn_where_it_is(tmp_path, kind):
    robot = urdf(tmp_path, f"../meshes/ball.{kind}", origin='<origin xyz="0 0 1"/>')
    BALL.export(tmp_path / f"arm/meshes/ball.{kind}")
    (ball,) = list_drawn_shapes(robot)
    away = np.linalg.norm(ball.vertices - [0, 0, 1], axis=1)
    np.testing.assert_allclose(away, 0.1, rtol=1e-6)
    assert len(ball.faces) == len(BALL.faces)
    assert len(ball.edges) == 0  # it bends by less than 30 degrees everywhere


@pytest.mark.parametrize(
    "name",
    [
        *("package://arm/meshes/ball.stl", "../meshes/ball.stl", "file://../meshes/ball.stl"),
        *("file://{folder}/arm/meshes/ball.stl", "package://tools/meshes/ball.stl"),
    ],
)
def test_names_lead_to_the_file(tmp_path, monkeypatch, name):
    robot = urdf(tmp_path, name.format(folder=tmp_path))
    (tmp_path / "ros/tools/meshes").mkdir(parents=True)
    for package in ("arm", "ros/tools"):
        BALL.export(tmp_path / package / "meshes/ball.stl")
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "ros"))
    assert len(list_drawn_shapes(robot)) == 1 and lack(robot) is None


def test_nothing_outside_of_the_package_is_opened(tmp_path):
    BALL.export(tmp_path / "secret.stl")
    robot = urdf(tmp_path, "package://arm/meshes/link.stl")
    os.symlink(tmp_path / "secret.stl", tmp_path / "arm/meshes/link.stl")
    assert list_drawn_shapes(robot) == [] and lack(robot).endswith("outside of its package")
    robot = urdf(tmp_path, f"file://{tmp_path}/secret.stl")
    assert list_drawn_shapes(robot) == [] and lack(robot).endswith("outside of its package")


def test_scale_and_colour_agree_with_the_urdf(tmp_path):
    color = '<material name="m"><color rgba="1 0.5 0 1"/></material>'
    robot = urdf(tmp_path, "../meshes/box.stl", scale='scale="2 -1 0.5"', color=color)
    trimesh.creation.box((0.2, 0.2, 0.2)).apply_translation((0.1, 0.1, 0.1)).export(
        tmp_path / "arm/meshes/box.stl"
    )
    (box,) = list_drawn_shapes(robot)
    np.testing.assert_allclose(box.vertices.min(axis=0), [0, -0.2, 0], atol=1e-7)
    np.testing.assert_allclose(box.vertices.max(axis=0), [0.4, 0, 0.1], atol=1e-7)
    volume = sum(np.linalg.det(box.vertices[list(face)]) / 6 for face in box.faces)
    assert volume == pytest.approx(0.4 * 0.2 * 0.1)  # above 0: a mirrored one still faces outwards
    assert box.color == "#ff8000" and len(box.edges) == 12


def test_a_unit_and_the_colours_of_a_file_are_its_own(tmp_path):
    scene = trimesh.Scene()
    for x, color in ((0, (255, 0, 0, 255)), (1, (0, 0, 255, 255))):
        box = trimesh.creation.box((1, 1, 1)).apply_translation((x, 0, 0))
        box.visual = trimesh.visual.TextureVisuals(
            material=trimesh.visual.material.PBRMaterial(baseColorFactor=color)
        )
        scene.add_geometry(box)
    robot = urdf(tmp_path, "../meshes/two.dae")
    path = tmp_path / "arm/meshes/two.dae"
    text = trimesh.exchange.dae.export_collada(list(scene.geometry.values())).decode()
    assert "<unit" not in text or 'meter="1' in text
    unit = '<unit name="centimeter" meter="0.01"/>'
    text = text.replace("<asset>", f"<asset>{unit}") if "<unit" not in text else text
    path.write_text(text.replace('<unit name="meter" meter="1"/>', unit))
    pieces = list_drawn_shapes(robot)
    assert {piece.color for piece in pieces} == {"#ff0000", "#0000ff"}
    corners = np.concatenate([piece.vertices for piece in pieces])
    np.testing.assert_allclose(np.ptp(corners, axis=0), [0.02, 0.01, 0.01], rtol=1e-6)


def nan_mesh():
    points = np.array([[0, 0, 0], [1, 0, 0], [0, np.nan, 0]])
    return trimesh.exchange.stl.export_stl(trimesh.Trimesh(points, [[0, 1, 2]], process=False))


BOMB = b'<?xml version="1.0"?><!DOCTYPE a [<!ENTITY b "b">]><COLLADA>&b;</COLLADA>'
WRONG = {
    "missing": (None, "not found"),
    "empty.stl": (b"", "no triangles|not readable"),
    "noise.stl": (bytes(range(256)) * 9, "no triangles|not readable|not finite"),
    "noise.glb": (bytes(range(256)) * 9, "not readable"),
    "noise.dae": (b"<COLLADA>" * 9, "noise.dae:1: not valid XML"),
    "bomb.dae": (BOMB, "a DOCTYPE"),
    "coded.dae": (b'<?xml version="1.0" encoding="utf-7"?><COLLADA/>', "encoding 'utf-7'"),
    "empty.obj": (b"v 0 0 0\n", "no triangles|not readable"),
    "beyond.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "not readable|do not exist"),
    "huge.obj": (b"v 0 0 0\nv 1e30 0 0\nv 0 1 0\nf 1 2 3\n", "not finite, or beyond"),
    "nan.stl": (nan_mesh(), "not finite"),
    "text.txt": (b"v 0 0 0\n", "no format of .stl"),
}


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_file_is_refused_by_its_name_and_simpler_shapes_are_drawn(tmp_path, name):
    content, told = WRONG[name]
    robot = urdf(tmp_path, f"../meshes/{name}", more=BOX)
    if content is not None:
        (tmp_path / "arm/meshes" / name).write_bytes(content)
    with pytest.warns(rs.errors.FileWarning, match=told) as caught:
        figure = rs.plot.robot(robot)
    assert len(caught) == 1 and name in str(caught[0].message) and figure is not None
    assert [type(each) for each in list_drawn_shapes(robot)] == [rs.Block]
    with pytest.raises(
        rs.errors.InputError, match="no hull of a Mesh"
    ):  # no result depends on files
        rs.kinematics.clearance(
            rs.Scene([robot], [rs.Object("b", rs.Block(1, 1, 1))]), [], "arm", "b"
        )


def test_files_and_surfaces_that_are_too_large_are_refused(tmp_path, monkeypatch):
    robot = urdf(tmp_path, "../meshes/ball.stl")
    BALL.export(tmp_path / "arm/meshes/ball.stl")
    monkeypatch.setattr(mesh_files, "LARGEST_FILE", 1000)
    assert "larger than" in lack(robot)
    monkeypatch.undo()
    (tmp_path / "arm/meshes/ball.glb").write_bytes(HOSTILE["copies.glb"]())
    robot = urdf(tmp_path, "../meshes/ball.glb")
    assert lack(robot).endswith("more than 1000000 triangles")


def test_without_the_extra_it_is_reported_once_for_all_meshes(tmp_path, monkeypatch):
    robot = urdf(tmp_path, "../meshes/ball.stl", more=BOX.replace("collision", "visual"))
    BALL.export(tmp_path / "arm/meshes/ball.stl")
    mesh_files._read_mesh_file.cache_clear()
    monkeypatch.setitem(__import__("sys").modules, "trimesh", None)
    with pytest.warns(
        rs.errors.FileWarning, match=r"1 of 1 meshes .*pip install 'robsim\[mesh\]'"
    ) as caught:
        rs.export_html(robot, tmp_path / "arm.html")
    assert len(caught) == 1
    mesh_files._read_mesh_file.cache_clear()


def test_a_mesh_is_the_same_value_with_its_file_and_without(tmp_path):
    robot = urdf(tmp_path, "../meshes/ball.stl")
    (mesh,) = robot.links[0].shapes
    assert mesh == rs.shapes.Mesh("../meshes/ball.stl") and hash(mesh) == hash(
        rs.shapes.Mesh(mesh.filename)
    )
    robot.to_urdf(tmp_path / "arm/urdf/again.urdf")
    BALL.export(tmp_path / "arm/meshes/ball.stl")
    again = rs.Robot.from_urdf(tmp_path / "arm/urdf/again.urdf")
    assert again.links[0].shapes == robot.links[0].shapes and len(list_drawn_shapes(again)) == 1


def test_ten_links_of_a_hundred_thousand_triangles_make_a_small_page(tmp_path):
    (tmp_path / "meshes").mkdir()
    rng = np.random.default_rng(0)
    links, joints = [], []
    for i in range(10):
        mesh = trimesh.creation.uv_sphere(radius=0.1, count=(225, 225))
        mesh.vertices *= 1 + 0.05 * np.sin(mesh.vertices @ rng.normal(scale=60, size=(3, 3)))
        assert len(mesh.faces) > 100_000
        mesh.export(tmp_path / f"meshes/l{i}.stl")
        links.append(
            LINK.format(
                name=f"l{i}", mesh=f"meshes/l{i}.stl", scale="", color="", more="", origin=""
            )
        )
        joints.append(
            f'<joint name="j{i}" type="continuous"><parent link="l{i - 1}"/><child link="l{i}"/>'
            f'<origin xyz="0 0 0.15"/><axis xyz="1 0 0"/></joint>'
        )
    text = f'<robot name="chain">{"".join(links + joints[1:])}</robot>'
    (tmp_path / "chain.urdf").write_text(text)
    robot = rs.Robot.from_urdf(tmp_path / "chain.urdf")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        page = rs.export_html(robot, tmp_path / "chain.html")
    assert page.stat().st_size < 3.4e6
    for part in list_scene_parts(rs.Scene(robot), 1.0):
        assert 1000 < len(part.wire.faces) < 9000
        assert np.ptp(part.wire.points[:, 2]) > 0.19  # still as large


@pytest.mark.parametrize(
    ("content", "text"),
    [
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\n", "no triangles"),
        ("v 0 0 0\nf 1 1 1\n", "no triangles with an area"),
    ],
)
@pytest.mark.parametrize("more", ["", BOX])
def test_a_picture_warns_of_a_mesh_without_faces(tmp_path, content, text, more):
    robot = urdf(tmp_path, "../meshes/flat.obj", more=more)
    (tmp_path / "arm/meshes/flat.obj").write_text(content)
    lens = rs.Camera([[20, 0, 9.5], [0, 20, 9.5], [0, 0, 1]], (20, 20))
    eye = rs.MountedCamera("eye", lens, pose=rs.Pose.at(0, 0, -1))
    scene = rs.Scene(robots=robot, cameras=eye)
    with pytest.warns(
        rs.errors.FileWarning, match=f"1 of 1 meshes .* '../meshes/flat.obj': {text}"
    ) as seen:
        image = scene.picture(background=7)
    assert seen[0].filename == __file__
    assert (image[9:11, 9:11] != 7).all() == bool(more)  # its collision shape


def test_a_picture_shows_a_mesh(tmp_path):
    robot = urdf(tmp_path, "../meshes/ball.stl")
    BALL.export(tmp_path / "arm/meshes/ball.stl")
    lens = rs.Camera([[200, 0, 59.5], [0, 200, 59.5], [0, 0, 1]], (120, 120))
    eye = rs.MountedCamera("eye", lens, pose=rs.Pose.at(0, 0, -0.5))
    image = rs.Scene(robots=robot, cameras=eye).picture(light=rs.shapes.Light(ambient=1.0))
    away = np.hypot(*(np.mgrid[:120, :120] - 59.5))
    rim = 200 * 0.1 / np.sqrt(0.5**2 - 0.1**2)  # of the ball, in pixels
    assert (image[away < rim - 2] == 153).all() and (image[away > rim + 1] == 50).all()


def test_a_picture_warns_of_a_mesh_without_a_folder():
    thing = rs.Object("arm", rs.shapes.Mesh("arm.stl"))
    lens = rs.Camera([[20, 0, 9.5], [0, 20, 9.5], [0, 0, 1]], (20, 20))
    scene = rs.Scene(objects=thing, cameras=rs.MountedCamera("eye", lens))
    with pytest.warns(rs.errors.FileWarning, match="'arm.stl': its folder is not known"):
        assert (scene.picture(background=7) == 7).all()
