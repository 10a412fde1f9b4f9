"""The URDF reader, which is strict, and the writers of URDF and MJCF for simulators.

A file that is read is untrusted data: it is never executed, meshes that it names are opened for
figures alone, and errors in it are reported with their lines.
"""

from robsim.robot.urdf.mjcf import write_mjcf as write_mjcf
from robsim.robot.urdf.read import read as read
from robsim.robot.urdf.write import write as write
