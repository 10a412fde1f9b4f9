"""The URDF reader, which is strict, and the writers of URDF and MJCF for simulators.

A file that is read is data from anywhere: it is never executed, nothing that it names is opened,
and whatever is wrong in it is told with its line.
"""

from robsim.robot.urdf.mjcf import write_mjcf as write_mjcf
from robsim.robot.urdf.read import read as read
from robsim.robot.urdf.write import write as write
