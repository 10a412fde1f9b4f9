"""Control of a robot outside of the simulation: commands, health, limits and ROS 2 messages."""

from robsim.engine.simulated_cell import CellInstant as CellInstant
from robsim.engine.simulated_cell import SimulatedCell as SimulatedCell
from robsim.logs.ros_messages import RosMessages as RosMessages
from robsim.run.control.drive_command import DriveCommand as DriveCommand
from robsim.run.control.drive_command import Health as Health
from robsim.run.control.mark_input import Marks as Marks
from robsim.run.control.standalone_controller import Controller as Controller
from robsim.run.ros_connection import RosConnection as RosConnection
from robsim.servo.safety.safety import Fence as Fence
from robsim.servo.safety.safety import Safety as Safety
from robsim.servo.safety.safety import Watchdog as Watchdog
