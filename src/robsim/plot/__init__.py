"""Figures of scenes and runs, made with Matplotlib; a figure is returned, never shown.

Where Matplotlib opens windows, plt.show() shows them; elsewhere they are the caller's alone, to
save with figure.savefig("name.pdf"). A notebook shows the figure that is the last line of a cell,
as it does with any value; display(figure) shows one before that.
"""

from robsim.plot.comparison_figure import comparison as comparison
from robsim.plot.diagnosis_figure import diagnosis as diagnosis
from robsim.plot.image_figure import image as image
from robsim.plot.joints_figure import joints as joints
from robsim.plot.moments_figure import moments as moments
from robsim.plot.robot_figure import robot as robot
from robsim.plot.run_figure import run as run
from robsim.plot.scene_figure import scene as scene
from robsim.plot.studies.basin_figure import study_basin as study_basin
from robsim.plot.studies.distributions_figure import study_distributions as study_distributions
from robsim.plot.studies.map_figure import study_map as study_map
from robsim.plot.studies.sensitivity_figure import study_sensitivity as study_sensitivity
from robsim.plot.studies.study_figure import study as study
from robsim.plot.studies.success_figure import study_success as study_success
from robsim.plot.velocity_figure import velocity as velocity
from robsim.plot.workspace_figure import workspace as workspace
