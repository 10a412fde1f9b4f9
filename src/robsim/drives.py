"""Drives of joints, which compute torques from commands, and their loads."""

from robsim.world.drives.computed_torque import ComputedTorque as ComputedTorque
from robsim.world.drives.computed_torque import GravityCompensatedPD as GravityCompensatedPD
from robsim.world.drives.drive_rows import DriveRows as DriveRows
from robsim.world.drives.drive_rows import DriveState as DriveState
from robsim.world.drives.industrial_servo import IndustrialServo as IndustrialServo
from robsim.world.drives.joint_drive import DriveModel as DriveModel
from robsim.world.drives.joint_drive import JointDrive as JointDrive
from robsim.world.drives.joint_drive import OwnDrive as OwnDrive
from robsim.world.drives.position_loop import PositionLoop as PositionLoop
from robsim.world.drives.torque_input import TorqueInput as TorqueInput
from robsim.world.drives.velocity_loop import VelocityLoop as VelocityLoop
from robsim.world.payload import Payload as Payload
