"""The message about meshes whose files cannot be read."""

from __future__ import annotations

from collections.abc import Iterable

from robsim.geometry.primitives.mesh import Mesh
from robsim.geometry.primitives.primitive import Primitive

MOST_NAMED = 3  # largest number of reasons in a message


def describe_unreadable_meshes(shapes: Iterable[Primitive]) -> str:
    """Return the message about meshes that are not drawn, with their number; "" for none.

    A mesh without a source is not counted: its shape is not known.

    >>> from pathlib import Path
    >>> from robsim.geometry.primitives.mesh import MeshSource
    >>> elbow = Mesh("elbow.stl", source=MeshSource(Path("nowhere")))
    >>> describe_unreadable_meshes([elbow])
    "1 of 1 meshes are not drawn, or simpler shapes: 'elbow.stl': not found"
    """
    meshes = [shape for shape in shapes if isinstance(shape, Mesh)]
    reasons = [reason for mesh in meshes if (reason := mesh.lack)]
    if not reasons:
        return ""
    different = [*dict.fromkeys(reasons)]
    text = "; ".join([*different[:MOST_NAMED], *["..."] * (len(different) > MOST_NAMED)])
    return f"{len(reasons)} of {len(meshes)} meshes are not drawn, or simpler shapes: {text}"
