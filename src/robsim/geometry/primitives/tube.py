"""A rectangular tube of two rings of four corners, 0-3 and 4-7, in blocks and camera bodies."""

from robsim.geometry.primitives.primitive import Face

RING = ((-1, -1), (1, -1), (1, 1), (-1, 1))
SIDES: tuple[Face, ...] = tuple((i, (i + 1) % 4, (i + 1) % 4 + 4, i + 4) for i in range(4))
