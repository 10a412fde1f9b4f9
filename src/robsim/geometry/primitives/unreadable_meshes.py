"""The warning about meshes whose files cannot be read."""

from __future__ import annotations

import warnings
from collections.abc import Iterable

from robsim.base.errors import FileWarning
from robsim.base.unit_warnings import find_user_stacklevel
from robsim.geometry.primitives.mesh import Mesh
from robsim.geometry.primitives.primitive import Primitive

MOST_NAMED = 3  # largest number of reasons in a warning


def warn_unreadable_meshes(shapes: Iterable[Primitive]) -> None:
    """Issue one FileWarning if meshes are not drawn; it reports their number.

    A mesh without a source is not counted: its shape is not known.
    """
    meshes = [shape for shape in shapes if isinstance(shape, Mesh)]
    reasons = [reason for mesh in meshes if (reason := mesh.lack)]
    if reasons:
        different = [*dict.fromkeys(reasons)]
        text = "; ".join([*different[:MOST_NAMED], *["..."] * (len(different) > MOST_NAMED)])
        message = f"{len(reasons)} of {len(meshes)} meshes are not drawn, or simpler shapes: {text}"
        warnings.warn(message, FileWarning, stacklevel=find_user_stacklevel())
