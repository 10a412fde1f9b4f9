"""Conversion of <link> elements to inertia, shapes and colours."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError, format_value
from robsim.base.xml_elements import Element
from robsim.geometry.inertia import Inertia
from robsim.geometry.primitives import Ball, Block, Mesh, Primitive, Wheel
from robsim.geometry.primitives.mesh_file import MeshFile
from robsim.robot.urdf.attribute_values import (
    read_attribute_number,
    read_attribute_vector,
    read_origin_pose,
    read_positive_number,
    split_words,
)
from robsim.robot.urdf.diagnostics import Diagnostics
from robsim.robot.urdf.vocabulary import (
    VOCABULARY,
    XACRO_HINT,
    find_child,
    find_children,
    is_xacro_expression,
    require_attribute,
)

# Inertia of 1 g that our writers give to massless moving links, so that simulators accept them.
# The reader removes it. The last digit distinguishes it from real links of 1 g, as in ANYmal C.
TOKEN_INERTIA = Inertia(1.00000001e-3, tensor=1e-6 * np.eye(3))
COLOR_LETTERS = {  # letters of the chapter, with the colours of MATLAB
    "k": "#000000",
    "w": "#ffffff",
    "r": "#ff0000",
    "g": "#00ff00",
    "b": "#0000ff",
    "c": "#00ffff",
    "m": "#ff00ff",
    "y": "#ffff00",
}
_LETTER_OF_CODE = {code: letter for letter, code in COLOR_LETTERS.items()}


def read_inertia(link: Element, findings: Diagnostics) -> Inertia | None:
    """Return the inertia of a link, or None if there is no <inertial> or all its numbers are 0.

    Mass and centre are always kept. A tensor that no rigid body has is kept and reported.
    """
    inertial = find_child(link, "inertial")
    if inertial is None:
        return None
    pose = read_origin_pose(inertial, findings)
    weight, moments = find_child(inertial, "mass"), find_child(inertial, "inertia")
    if weight is None:
        findings.odd(inertial, "without <mass>, left out")
        return None
    mass = read_attribute_number(weight, "value", findings)
    if moments is None:
        findings.odd(inertial, "without <inertia>, read as the mass of a point")
    tensor = np.zeros((3, 3)) if moments is None else _read_inertia_tensor(moments, findings)
    if mass is not None and mass < 0:
        findings.error(weight, f"value is {mass:g}; it must not be below 0")
    if mass is None or mass < 0 or tensor is None or not (mass or tensor.any()):
        return None
    inertia = Inertia(mass, tensor=tensor, strict=False)
    if inertia.defect is not None:
        findings.odd(inertial, f"no rigid body has this inertia: {inertia.defect}; kept")
    return inertia.at(pose)


def _read_inertia_tensor(element: Element, findings: Diagnostics) -> Array | None:
    """Return the inertia tensor (3, 3), or None after an error."""
    numbers = {}
    for name in VOCABULARY["inertia"].attributes:
        numbers[name] = read_attribute_number(
            element, name, findings, None if name[1] == name[2] else 0.0
        )
    if any(value is None for value in numbers.values()):
        return None
    rows = [[numbers["i" + "".join(sorted(i + j))] for j in "xyz"] for i in "xyz"]
    return np.array(rows, dtype=float)


def read_shapes(
    link: Element, colors: Mapping[str, str], findings: Diagnostics
) -> tuple[Primitive, ...]:
    """Return the visual shapes of a link, or its collision shapes if there are none.

    Each mesh refers to its file, and the first mesh also the collision shapes as
    substitutes.
    """
    visual, collision = (
        [
            shape
            for each in find_children(link, tag)
            if (shape := _read_shape(each, colors, findings))
        ]
        for tag in ("visual", "collision")
    )
    stand_ins = [shape for shape in collision if not isinstance(shape, Mesh)] if visual else []
    folder = Path(findings.source).absolute().parent
    result: list[Primitive] = []
    for shape in visual or collision:
        if isinstance(shape, Mesh):
            moved = tuple(each.at(shape.pose.inv()) for each in stand_ins)
            result.append(replace(shape, content=MeshFile(shape.filename, folder, moved)))
            stand_ins = []
        else:
            result.append(shape)
    return tuple(result)


def read_material_colors(robot: Element, findings: Diagnostics) -> dict[str, str]:
    """Return the colours of all named materials, from every place of definition."""
    visuals = [v for k in find_children(robot, "link") for v in k.children if v.tag in _SHAPE_TAGS]
    palette = {}
    for owner in (*visuals, robot):  # materials of the robot take precedence
        for material in find_children(owner, "material"):
            color = _read_color(material, findings)
            name = material.attributes.get("name")
            if color is not None and name:
                palette[name] = color
    return palette


_SHAPE_TAGS = ("visual", "collision")


def _read_color(material: Element, findings: Diagnostics) -> str | None:
    """Return the colour of a <material> without opacity, as a letter if it is exact."""
    element = find_child(material, "color")
    rgba = None if element is None else read_attribute_vector(element, "rgba", findings, count=4)
    if element is None or rgba is None:
        return None
    if (rgba < 0).any() or (rgba > 1).any():
        findings.error(element, "rgba: four numbers from 0 to 1 are allowed")
        return None
    code = "#" + "".join(f"{round(255 * part):02x}" for part in rgba[:3])
    return _LETTER_OF_CODE.get(code, code)


def _read_shape(
    element: Element, palette: Mapping[str, str], findings: Diagnostics
) -> Primitive | None:
    """Return the shape of a <visual> or <collision>, or None after an error."""
    pose = read_origin_pose(element, findings)
    geometry = find_child(element, "geometry")
    if geometry is None or not geometry.children:
        findings.error(element, "<geometry> is missing or empty; a box, cylinder, ... is allowed")
        return None
    solids = [each for each in geometry.children if each.tag in VOCABULARY["geometry"].children]
    if len(solids) > 1:
        findings.error(geometry, f"{len(solids)} shapes; only one is allowed")
    shape = _read_solid(solids[0], findings) if len(solids) == 1 else None
    if shape is None:
        return None
    material = find_child(element, "material")
    color = None if material is None else _read_color(material, findings)
    if material is not None and color is None:
        color = palette.get(material.attributes.get("name", ""))
    return replace(shape, color=color or "k").at(pose)  # type: ignore[call-arg]


def _read_solid(element: Element, findings: Diagnostics) -> Primitive | None:
    """Return the primitive of a geometry element, or None after an error."""
    if element.tag == "box":
        return _read_box(element, findings)
    if element.tag == "mesh":
        return _read_mesh_element(element, findings)
    radius = read_positive_number(element, "radius", findings)
    if element.tag == "sphere":
        return None if radius is None else Ball(radius)
    length = read_positive_number(element, "length", findings)
    return None if radius is None or length is None else Wheel(radius, length)


def _read_box(element: Element, findings: Diagnostics) -> Block | None:
    """Return a block, or None after an error."""
    sides = read_attribute_vector(element, "size", findings)
    if sides is None:
        return None
    if (sides > 0).all():
        return Block(*sides)
    if (sides < 0).any():
        findings.error(element, "size: three numbers above 0 are allowed")
    else:
        findings.odd(element, "a size is 0, so nothing is visible; left out")
    return None


def _read_mesh_element(element: Element, findings: Diagnostics) -> Mesh | None:
    """Return a mesh, or None if its name or scale cannot be used."""
    name, scale = element.attributes.get("filename", ""), element.attributes.get("scale", "1 1 1")
    if is_xacro_expression(name):
        findings.odd(element, f"filename = {format_value(name)}: {XACRO_HINT}; left out")
        return None
    if len(split_words(scale, 3)) != 3:
        findings.odd(element, f"scale = {format_value(scale)}: expected 3 numbers; left out")
        return None
    factors = read_attribute_vector(element, "scale", findings, "1 1 1")
    if require_attribute(element, "filename", findings) is None or factors is None:
        return None
    try:
        return Mesh(name, tuple(factors.tolist()))
    except InputError as error:
        if _is_outside_model(name) and factors.all():
            findings.odd(element, f"{error}; left out")
        else:
            findings.error(element, str(error))
        return None


def _is_outside_model(mesh: str) -> bool:
    """Return whether a mesh name refers to a folder outside of the folder of the model.

    Exporters write "../../meshes/arm.stl" and "file://meshes/arm.stl", which are reported as
    oddities. No exporter writes a package that is left by "..", or an absolute path without a
    scheme; these are errors.
    """
    if mesh.startswith("file://"):
        return True
    relative = not mesh.startswith(("package://", "/")) and not set(mesh) & {"\\", ":"}
    return relative and ".." in mesh.split("/")
