"""The declaration of an image's width and height."""

from robsim.declare import ListOf, Whole

SIZE = ListOf(Whole(1, 1_000_000), 2, 2)
