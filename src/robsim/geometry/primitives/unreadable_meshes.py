"""The warning about meshes whose files cannot be read."""

from __future__ import annotations

import warnings
from collections.abc import Iterable

from robsim.base.errors import FileWarning, format_value
from robsim.base.unit_warnings import find_user_stacklevel
from robsim.geometry.primitives.mesh import Mesh
from robsim.geometry.primitives.primitive import Primitive

MOST_NAMED = 3  # largest number of reasons in a warning


def warn_unreadable_meshes(shapes: Iterable[Primitive], with_unknown: bool = False) -> None:
    """Issue one FileWarning if meshes are not drawn; it reports their number.

    Meshes without content, are counted if `with_unknown`.
    """
    meshes = [shape for shape in shapes if isinstance(shape, Mesh)]
    reasons = [reason for mesh in meshes if (reason := _find_reason(mesh, with_unknown))]
    if reasons:
        different = [*dict.fromkeys(reasons)]
        text = "; ".join([*different[:MOST_NAMED], *["..."] * (len(different) > MOST_NAMED)])
        message = f"{len(reasons)} of {len(meshes)} meshes are not drawn, or simpler shapes: {text}"
        warnings.warn(message, FileWarning, stacklevel=find_user_stacklevel())


def _find_reason(mesh: Mesh, with_unknown: bool) -> str | None:
    """Return the reason why a mesh is not drawn, or None."""
    if mesh.content is None and with_unknown:
        return f"{format_value(mesh.filename)}: its folder is not known"
    return mesh.lack
