"""Marks in groups of two or of four."""

from robsim.base.errors import InputError


def check_groups(N: int, size: int, who: str) -> None:
    """Raise InputError if `size` does not divide a number of marks."""
    if not N or N % size:
        raise InputError(
            f"{who}: takes marks {size} by {size}, so their number must be a multiple of {size}; "
            f"the target has {N}"
        )
