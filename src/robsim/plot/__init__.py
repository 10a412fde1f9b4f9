"""Figures of scenes and runs, made with Matplotlib; a figure is returned, never shown.

Where Matplotlib opens windows, plt.show() shows them; elsewhere they are the caller's alone, to
save with figure.savefig("name.pdf"). A notebook shows the figure that is the last line of a cell,
as it does with any value; display(figure) shows one before that.
"""

from robsim.base.lazy_names import attach_names

__getattr__, __dir__ = attach_names(__name__, __file__)
