"""Conversion of <link> to the inertia, shapes and colours of a Link."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from robsim.base.arrays import Array
from robsim.base.elements import Element
from robsim.base.errors import InputError, said
from robsim.geometry.inertia import Inertia
from robsim.geometry.primitives import Ball, Block, Mesh, Primitive, Wheel
from robsim.geometry.primitives.mesh import MeshSource
from robsim.robot.urdf.findings import Findings
from robsim.robot.urdf.values import number, origin, size, split, vector
from robsim.robot.urdf.words import WORDS, XACRO, child, children, is_expression, needed

# our writers' inertia of moving links without mass, so that simulators accept them
TOKEN = Inertia(1e-3, tensor=1e-6 * np.eye(3))
LETTERS = {  # the letters of the chapter, as MATLAB shows them
    "k": "#000000",
    "w": "#ffffff",
    "r": "#ff0000",
    "g": "#00ff00",
    "b": "#0000ff",
    "c": "#00ffff",
    "m": "#ff00ff",
    "y": "#ffff00",
}
_NAMES = {code: letter for letter, code in LETTERS.items()}


def inertia(link: Element, findings: Findings) -> Inertia | None:
    """Return the inertia of a link; None if there is no <inertial>, or no mass."""
    given = child(link, "inertial")
    if given is None:
        return None
    where = origin(given, findings)
    weight, moments = child(given, "mass"), child(given, "inertia")
    if weight is None or moments is None:
        both = ("<mass>", weight), ("<inertia>", moments)
        lacking = [tag for tag, part in both if part is None]
        findings.odd(given, f"without {' and '.join(lacking)}, left out")
        return None
    mass, tensor = number(weight, "value", findings), _tensor(moments, findings)
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


def _tensor(element: Element, findings: Findings) -> Array | None:
    numbers = {}
    for name in WORDS["inertia"].attributes:
        numbers[name] = number(element, name, findings, None if name[1] == name[2] else 0.0)
    if any(value is None for value in numbers.values()):
        return None
    rows = [[numbers["i" + "".join(sorted(i + j))] for j in "xyz"] for i in "xyz"]
    return np.array(rows, dtype=float)


def shapes(link: Element, colors: Mapping[str, str], findings: Findings) -> tuple[Primitive, ...]:
    """Return the visual shapes of a link, or its collision shapes if there are none.

    A mesh knows the folder of the file, and the first one the collision shapes in place of it.
    """
    seen, hit = (
        [shape for each in children(link, tag) if (shape := _shape(each, colors, findings))]
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


def colors(robot: Element, findings: Findings) -> dict[str, str]:
    """Return the colours of all materials with a name, wherever they are defined."""
    drawn = [v for k in children(robot, "link") for v in k.children if v.tag in _DRAWN]
    found = {}
    for owner in (*drawn, robot):  # materials of the robot take precedence
        for material in children(owner, "material"):
            color = _own_color(material, findings)
            name = material.attributes.get("name")
            if color is not None and name:
                found[name] = color
    return found


_DRAWN = ("visual", "collision")


def _own_color(material: Element, findings: Findings) -> str | None:
    """Return the colour of a <material> without opacity, as a letter where that is exact."""
    element = child(material, "color")
    rgba = None if element is None else vector(element, "rgba", findings, count=4)
    if element is None or rgba is None:
        return None
    if (rgba < 0).any() or (rgba > 1).any():
        findings.error(element, "rgba: four numbers from 0 to 1 are allowed")
        return None
    code = "#" + "".join(f"{round(255 * part):02x}" for part in rgba[:3])
    return _NAMES.get(code, code)


def _shape(element: Element, named: Mapping[str, str], findings: Findings) -> Primitive | None:
    where = origin(element, findings)
    geometry = child(element, "geometry")
    if geometry is None or not geometry.children:
        findings.error(element, "<geometry> is missing or empty; a box, cylinder, ... is allowed")
        return None
    solids = [each for each in geometry.children if each.tag in WORDS["geometry"].children]
    if len(solids) > 1:
        findings.error(geometry, f"{len(solids)} shapes; only one is allowed")
    shape = _solid(solids[0], findings) if len(solids) == 1 else None
    if shape is None:
        return None
    material = child(element, "material")
    color = None if material is None else _own_color(material, findings)
    if material is not None and color is None:
        color = named.get(material.attributes.get("name", ""))
    return replace(shape, color=color or "k").at(where)  # type: ignore[call-arg]


def _solid(element: Element, findings: Findings) -> Primitive | None:
    if element.tag == "box":
        return _box(element, findings)
    if element.tag == "mesh":
        return _mesh(element, findings)
    radius = size(element, "radius", findings)
    if element.tag == "sphere":
        return None if radius is None else Ball(radius)
    length = size(element, "length", findings)
    return None if radius is None or length is None else Wheel(radius, length)


def _box(element: Element, findings: Findings) -> Block | None:
    sides = vector(element, "size", findings)
    if sides is None:
        return None
    if (sides > 0).all():
        return Block(*sides)
    if (sides < 0).any():
        findings.error(element, "size: three numbers above 0 are allowed")
    else:
        findings.odd(element, "a size is 0, so that there is nothing to see; left out")
    return None


def _mesh(element: Element, findings: Findings) -> Mesh | None:
    name, scale = element.attributes.get("filename", ""), element.attributes.get("scale", "1 1 1")
    if is_expression(name):
        findings.odd(element, f"filename = {said(name)}: {XACRO}; left out")
        return None
    if len(split(scale, 3)) != 3:
        findings.odd(element, f"scale = {said(scale)}: expected 3 numbers; left out")
        return None
    factors = vector(element, "scale", findings, "1 1 1")
    if needed(element, "filename", findings) is None or factors is None:
        return None
    try:
        return Mesh(name, tuple(factors.tolist()))
    except InputError as error:
        if _is_elsewhere(name) and factors.all():
            findings.odd(element, f"{error}; left out")
        else:
            findings.error(element, str(error))
        return None


def _is_elsewhere(mesh: str) -> bool:
    """Return whether a mesh name refers to a folder outside that of the model.

    Exporters write "../../meshes/arm.stl" and "file://meshes/arm.stl". None writes a package that
    is left by "..", or an absolute place without a scheme: these stay mistakes, or worse.
    """
    if mesh.startswith("file://"):
        return True
    relative = not mesh.startswith(("package://", "/")) and not set(mesh) & {"\\", ":"}
    return relative and ".." in mesh.split("/")
