"""Kinematics of a robot: inverse kinematics, manipulability, workspace and clearance."""

from robsim.analysis.manipulability import condition_number as condition_number
from robsim.analysis.manipulability import manipulability as manipulability
from robsim.analysis.manipulability import singularity_distance as singularity_distance
from robsim.analysis.workspace import Workspace as Workspace
from robsim.analysis.workspace import sample_workspace as sample_workspace
from robsim.robot.dynamics import FreeMotion as FreeMotion
from robsim.robot.ik.closed_form import ClosedFormIK as ClosedFormIK
from robsim.robot.ik.ik_result import IKReason as IKReason
from robsim.robot.ik.ik_result import IKResult as IKResult
from robsim.world.clearance import clearance as clearance
