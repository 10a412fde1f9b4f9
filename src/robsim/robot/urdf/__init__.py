"""The URDF reader, which is strict, and the writers of URDF and MJCF for simulators.

A file that is read is untrusted data: it is never executed, meshes that it names are opened for
figures alone, and errors in it are reported with their lines.
"""

from robsim.robot.urdf.mjcf_writer import write_mjcf as write_mjcf
from robsim.robot.urdf.urdf_reader import read_urdf as read_urdf
from robsim.robot.urdf.urdf_writer import write_urdf as write_urdf
