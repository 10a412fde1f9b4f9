"""Figures of scenes, runs, comparisons and studies, drawn with Matplotlib.

Every function returns a `matplotlib.figure.Figure` and shows nothing. If the backend of Matplotlib
opens windows, pyplot manages the figure and `plt.show()` shows it. With other backends only the
caller holds the figure; save it with `figure.savefig("name.pdf")`. A notebook displays a figure
that is the last expression of a cell; call `display(figure)` to show a figure earlier in a cell.
"""

import os
import sys

from robsim.base.environment import refuse_variable
from robsim.base.lazy_names import attach_names


def _check_backend() -> None:
    """Raise InputError if Matplotlib does not know the backend of the variable MPLBACKEND."""
    backend = os.environ.get("MPLBACKEND", "agg")
    if backend.lower() == "agg" or "matplotlib" in sys.modules:
        return
    try:
        import matplotlib  # noqa: F401  it checks the variable
    except ValueError as reason:
        refuse_variable("MPLBACKEND", backend, str(reason).partition("supported values are ")[2])


_check_backend()
__getattr__, __dir__, __all__ = attach_names(__name__, __file__)
