"""Figures of scenes, runs, comparisons and studies, drawn with Matplotlib.

Every function returns a `matplotlib.figure.Figure` and shows nothing. If the backend of Matplotlib
opens windows, pyplot manages the figure and `plt.show()` shows it. With other backends only the
caller holds the figure; save it with `figure.savefig("name.pdf")`. A notebook displays a figure
that is the last expression of a cell; call `display(figure)` to show a figure earlier in a cell.
"""

from robsim.base.environment import check_matplotlib_backend
from robsim.base.lazy_names import attach_names

check_matplotlib_backend()
__getattr__, __dir__, __all__ = attach_names(__name__, __file__)
