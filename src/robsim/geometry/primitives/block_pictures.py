"""Pictures on the faces of a block."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

from robsim.declare import Role, check_fields, described
from robsim.geometry.grey_picture import GreyPicture, PictureLike
from robsim.geometry.picture_spec import PICTURE


@described
@dataclass(frozen=True)
class BlockPictures:
    """Pictures on single faces of a `Block`, by the names of the faces.

    Raises
    ------
    FileError or InputError
        If a picture cannot be read, as by `Poster`.

    Examples
    --------
    >>> import numpy as np
    >>> label = np.zeros((20, 30), dtype=np.uint8)
    >>> BlockPictures(top=label).top
    GreyPicture(30 x 20 pixels, 5384d4dbdd96)
    """

    front: Annotated[GreyPicture | None, PICTURE, Role.FIGURE, "Picture towards +x."] = None
    back: Annotated[GreyPicture | None, PICTURE, Role.FIGURE, "Picture towards -x."] = None
    left: Annotated[GreyPicture | None, PICTURE, Role.FIGURE, "Picture towards +y."] = None
    right: Annotated[GreyPicture | None, PICTURE, Role.FIGURE, "Picture towards -y."] = None
    top: Annotated[GreyPicture | None, PICTURE, Role.FIGURE, "Picture towards +z."] = None
    bottom: Annotated[GreyPicture | None, PICTURE, Role.FIGURE, "Picture towards -z."] = None

    if TYPE_CHECKING:  # the types of the arguments are wider than the types of the attributes

        def __init__(
            self,
            front: PictureLike | None = None,
            back: PictureLike | None = None,
            left: PictureLike | None = None,
            right: PictureLike | None = None,
            top: PictureLike | None = None,
            bottom: PictureLike | None = None,
        ) -> None: ...

    def __post_init__(self) -> None:
        check_fields(self)
