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
from robsim.plot.studies.basin import study_basin as study_basin
from robsim.plot.studies.distributions import study_distributions as study_distributions
from robsim.plot.studies.map import study_map as study_map
from robsim.plot.studies.sensitivity import study_sensitivity as study_sensitivity
from robsim.plot.studies.study import study as study
from robsim.plot.studies.success import study_success as study_success
from robsim.plot.velocity import velocity as velocity
from robsim.plot.workspace import workspace as workspace
