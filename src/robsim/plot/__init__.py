"""Figures of scenes and runs, made with Matplotlib; a figure is returned, never shown.

Where Matplotlib opens windows, plt.show() shows them; elsewhere they are the caller's alone, to
save with figure.savefig("name.pdf"). A notebook shows the figure that is the last line of a cell,
as it does with any value; display(figure) shows one before that.
"""

from robsim.plot.comparison import comparison as comparison
from robsim.plot.diagnosis import diagnosis as diagnosis
from robsim.plot.image import image as image
from robsim.plot.joints import joints as joints
from robsim.plot.moments import moments as moments
from robsim.plot.robot import robot as robot
from robsim.plot.run import run as run
from robsim.plot.scene import scene as scene
from robsim.plot.velocity import velocity as velocity
from robsim.plot.workspace import workspace as workspace
