"""RobSim: model, simulate and see robots that are guided by cameras.

>>> Pose.at(0, 0, 1).position
array([0., 0., 1.])
"""

import importlib
from types import ModuleType
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

from robsim import trajectory as trajectory
from robsim.analysis.equilibria import equilibria as equilibria
from robsim.analysis.equilibrium import Equilibria as Equilibria
from robsim.analysis.equilibrium import Equilibrium as Equilibrium
from robsim.analysis.manipulability import condition_number as condition_number
from robsim.analysis.manipulability import manipulability as manipulability
from robsim.analysis.manipulability import singularity_distance as singularity_distance
from robsim.analysis.workspace import Workspace as Workspace
from robsim.analysis.workspace import workspace as workspace
from robsim.base import units as units
from robsim.base.errors import FileError as FileError
from robsim.base.errors import FileWarning as FileWarning
from robsim.base.errors import FrameError as FrameError
from robsim.base.errors import GoalError as GoalError
from robsim.base.errors import InputError as InputError
from robsim.base.errors import Interrupted as Interrupted
from robsim.base.errors import RankWarning as RankWarning
from robsim.base.errors import RobSimError as RobSimError
from robsim.base.errors import UnitError as UnitError
from robsim.base.errors import UnitWarning as UnitWarning
from robsim.features import DecoupledMoments as DecoupledMoments
from robsim.features import Ellipse as Ellipse
from robsim.features import Lines as Lines
from robsim.features import LogDepth as LogDepth
from robsim.features import Observation as Observation
from robsim.features import PixelPoints as PixelPoints
from robsim.features import PointMoments as PointMoments
from robsim.features import Points as Points
from robsim.features import Points3D as Points3D
from robsim.features import Polar as Polar
from robsim.features import RegionMoments as RegionMoments
from robsim.features import Segments as Segments
from robsim.features import Sphere as Sphere
from robsim.features import Spherical as Spherical
from robsim.features import StereoPoints as StereoPoints
from robsim.features import ThetaU as ThetaU
from robsim.features import Translation as Translation
from robsim.features import VanishingPoint as VanishingPoint
from robsim.files import examples as examples
from robsim.files import robots as robots
from robsim.geometry import curves as curves
from robsim.geometry.inertia import Inertia as Inertia
from robsim.geometry.pose import Pose as Pose
from robsim.geometry.primitives import Ball as Ball
from robsim.geometry.primitives import Block as Block
from robsim.geometry.primitives import CameraBody as CameraBody
from robsim.geometry.primitives import Mesh as Mesh
from robsim.geometry.primitives import Wheel as Wheel
from robsim.robot.ik.closed import ClosedIK as ClosedIK
from robsim.robot.ik.result import IKReason as IKReason
from robsim.robot.ik.result import IKResult as IKResult
from robsim.robot.joint import Ackermann as Ackermann
from robsim.robot.joint import Chord as Chord
from robsim.robot.joint import Joint as Joint
from robsim.robot.joint import JointKind as JointKind
from robsim.robot.joint import Mimic as Mimic
from robsim.robot.joint import Rolling as Rolling
from robsim.robot.joint import Steering as Steering
from robsim.robot.link import Link as Link
from robsim.robot.robot import Robot as Robot
from robsim.run.experiment import Experiment as Experiment
from robsim.run.experiment import load_scenario as load_scenario
from robsim.run.mission import Mission as Mission
from robsim.run.mission_run import MissionRun as MissionRun
from robsim.run.outcome import Outcome as Outcome
from robsim.run.phase import Phase as Phase
from robsim.run.simulate import simulate as simulate
from robsim.servo import IBVS as IBVS
from robsim.servo import PBVS as PBVS
from robsim.servo import AdaptiveGain as AdaptiveGain
from robsim.servo import AvoidLimits as AvoidLimits
from robsim.servo import Broyden as Broyden
from robsim.servo import CameraLaw as CameraLaw
from robsim.servo import ControlState as ControlState
from robsim.servo import DampedInverse as DampedInverse
from robsim.servo import DepthFilter as DepthFilter
from robsim.servo import Docking as Docking
from robsim.servo import ErrorBelow as ErrorBelow
from robsim.servo import EstimatedMotion as EstimatedMotion
from robsim.servo import FeatureBlock as FeatureBlock
from robsim.servo import FollowJoints as FollowJoints
from robsim.servo import FollowPath as FollowPath
from robsim.servo import GoalFeatures as GoalFeatures
from robsim.servo import GoalPose as GoalPose
from robsim.servo import Hybrid as Hybrid
from robsim.servo import JacobianTranspose as JacobianTranspose
from robsim.servo import JointLaw as JointLaw
from robsim.servo import LargeProjection as LargeProjection
from robsim.servo import NearBorder as NearBorder
from robsim.servo import Parallel as Parallel
from robsim.servo import Partitioned as Partitioned
from robsim.servo import PartitionedLaw as PartitionedLaw
from robsim.servo import Placing as Placing
from robsim.servo import Posture as Posture
from robsim.servo import Priorities as Priorities
from robsim.servo import PseudoInverse as PseudoInverse
from robsim.servo import ServoTask as ServoTask
from robsim.servo import SpeedLimit as SpeedLimit
from robsim.servo import Switch as Switch
from robsim.servo import TaughtGoal as TaughtGoal
from robsim.vision import HomographyMotions as HomographyMotions
from robsim.vision import PoseEstimate as PoseEstimate
from robsim.vision import Triangulation as Triangulation
from robsim.vision import decompose_homography as decompose_homography
from robsim.vision import estimate_pose as estimate_pose
from robsim.vision import homography as homography
from robsim.vision import triangulate as triangulate
from robsim.vision.camera import Camera as Camera
from robsim.vision.camera import Visibility as Visibility
from robsim.world.actuation import Actuation as Actuation
from robsim.world.motion import Motion as Motion
from robsim.world.mounted_camera import MountedCamera as MountedCamera
from robsim.world.object import Object as Object
from robsim.world.scene import Scene as Scene
from robsim.world.sensing import Occlusion as Occlusion
from robsim.world.sensing import Sensing as Sensing

if TYPE_CHECKING:
    from robsim import plot as plot
    from robsim.analysis.clearance import clearance as clearance
    from robsim.analysis.compare import compare as compare
    from robsim.analysis.comparison import Comparison as Comparison
    from robsim.analysis.diagnosis import diagnose as diagnose
    from robsim.analysis.explain import Explanation as Explanation
    from robsim.analysis.explain import explain as explain
    from robsim.files.netcdf import open_run as open_run
    from robsim.files.netcdf import save_run as save_run
    from robsim.files.table import table as table
    from robsim.run.replay import replay as replay

# modules that are part of the public surface; all others are private
_DOORS = (
    "classic",
    "curves",
    "declare",
    "examples",
    "plot",
    "robots",
    "testing",
    "trajectory",
    "units",
)
# what needs xarray or matplotlib is imported when it is first used
_LAZY = {
    "classic": "robsim.classic",
    "declare": "robsim.declare",
    "plot": "robsim.plot",
    "testing": "robsim.testing",
    "clearance": "robsim.analysis.clearance",
    "Comparison": "robsim.analysis.comparison",
    "compare": "robsim.analysis.compare",
    "diagnose": "robsim.analysis.diagnosis",
    "Explanation": "robsim.analysis.explain",
    "explain": "robsim.analysis.explain",
    "open_run": "robsim.files.netcdf",
    "save_run": "robsim.files.netcdf",
    "replay": "robsim.run.replay",
    "table": "robsim.files.table",
}


def __getattr__(name: str) -> Any:
    if name not in _LAZY:
        raise AttributeError(f"module 'robsim' has no attribute {name!r}")
    module = importlib.import_module(_LAZY[name])
    return module if name in _DOORS else getattr(module, name)


def __dir__() -> list[str]:
    """Return the public names: classes, functions, and the modules that are doors."""
    own = (name for name, value in globals().items() if not isinstance(value, ModuleType))
    public = {name for name in own if not name.startswith("_")} - {"Any", "TYPE_CHECKING"}
    return sorted({*public, *_LAZY, *_DOORS} - {"ModuleType"})
