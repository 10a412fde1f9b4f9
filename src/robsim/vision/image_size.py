"""The declaration of the width and height of an image."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from robsim.declare import Integer, ListOf

PIXELS = Integer(1, 1_000_000)


@dataclass(frozen=True)
class ImageSize(ListOf):
    """The declaration of the width and height of an image in whole pixels."""

    phrase: ClassVar[str] = "[width, height] in whole pixels"
    python_phrase: ClassVar[str] = "(width, height) in whole pixels"


SIZE = ImageSize(PIXELS, 2, 2)
