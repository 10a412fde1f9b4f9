"""Conversion of <link> to the inertia, shapes and colours of a Link."""

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
from robsim.geometry.primitives.mesh import MeshSource
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

# our writers' inertia of moving links without mass, so that simulators accept them
TOKEN_INERTIA = Inertia(1e-3, tensor=1e-6 * np.eye(3))
COLOR_LETTERS = {  # the letters of the chapter, as MATLAB shows them
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
    """Return the inertia of a link; None if there is no <inertial>, or no mass."""
    given = find_child(link, "inertial")
    if given is None:
        return None
    where = read_origin_pose(given, findings)
    weight, moments = find_child(given, "mass"), find_child(given, "inertia")
    if weight is None or moments is None:
        both = ("<mass>", weight), ("<inertia>", moments)
        lacking = [tag for tag, part in both if part is None]
        findings.odd(given, f"without {' and '.join(lacking)}, left out")
        return None
    mass, tensor = (
        read_attribute_number(weight, "value", findings),
        _read_inertia_tensor(moments, findings),
    )
    if mass is not None and mass < 0:
        findings.error(weight, f"value is {mass:g}; it must not be below 0")
    if mass is None or mass < 0 or tensor is None:
        return None
    if mass == 0:
        if tensor.any():
            findings.odd(given, "a tensor without a mass, left out")
        return None
    try:
        found = Inertia(mass, tensor=tensor).at(where)
    except InputError as error:
        findings.odd(given, f"{error}; left out")
        return None
    return found


def _read_inertia_tensor(element: Element, findings: Diagnostics) -> Array | None:
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

    A mesh knows the folder of the file, and the first one the collision shapes in place of it.
    """
    seen, hit = (
        [
            shape
            for each in find_children(link, tag)
            if (shape := _read_shape(each, colors, findings))
        ]
        for tag in ("visual", "collision")
    )
    stand_ins = [shape for shape in hit if not isinstance(shape, Mesh)] if seen else []
    folder = Path(findings.source).absolute().parent
    found: list[Primitive] = []
    for shape in seen or hit:
        if isinstance(shape, Mesh):
            here = tuple(each.at(shape.pose.inv()) for each in stand_ins)
            found.append(replace(shape, source=MeshSource(folder, here)))
            stand_ins = []
        else:
            found.append(shape)
    return tuple(found)


def read_material_colors(robot: Element, findings: Diagnostics) -> dict[str, str]:
    """Return the colours of all materials with a name, wherever they are defined."""
    drawn = [v for k in find_children(robot, "link") for v in k.children if v.tag in _SHAPE_TAGS]
    found = {}
    for owner in (*drawn, robot):  # materials of the robot take precedence
        for material in find_children(owner, "material"):
            color = _read_color(material, findings)
            name = material.attributes.get("name")
            if color is not None and name:
                found[name] = color
    return found


_SHAPE_TAGS = ("visual", "collision")


def _read_color(material: Element, findings: Diagnostics) -> str | None:
    """Return the colour of a <material> without opacity, as a letter where that is exact."""
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
    element: Element, named: Mapping[str, str], findings: Diagnostics
) -> Primitive | None:
    where = read_origin_pose(element, findings)
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
        color = named.get(material.attributes.get("name", ""))
    return replace(shape, color=color or "k").at(where)  # type: ignore[call-arg]


def _read_solid(element: Element, findings: Diagnostics) -> Primitive | None:
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
    sides = read_attribute_vector(element, "size", findings)
    if sides is None:
        return None
    if (sides > 0).all():
        return Block(*sides)
    if (sides < 0).any():
        findings.error(element, "size: three numbers above 0 are allowed")
    else:
        findings.odd(element, "a size is 0, so that there is nothing to see; left out")
    return None


def _read_mesh_element(element: Element, findings: Diagnostics) -> Mesh | None:
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
    """Return whether a mesh name refers to a folder outside that of the model.

    Exporters write "../../meshes/arm.stl" and "file://meshes/arm.stl". None writes a package that
    is left by "..", or an absolute place without a scheme: these stay mistakes, or worse.
    """
    if mesh.startswith("file://"):
        return True
    relative = not mesh.startswith(("package://", "/")) and not set(mesh) & {"\\", ":"}
    return relative and ".." in mesh.split("/")
