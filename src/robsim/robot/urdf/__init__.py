"""Reader of URDF, and writers of URDF and MJCF for simulators.

The reader is strict. A file is untrusted data: nothing in it is executed, its meshes are opened for
figures only, and errors are reported with their lines.
"""

from robsim.robot.urdf.mjcf_writer import write_mjcf as write_mjcf
from robsim.robot.urdf.urdf_reader import read_urdf as read_urdf
from robsim.robot.urdf.urdf_writer import write_urdf as write_urdf
