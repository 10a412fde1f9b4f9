"""RobSim: model, simulate and see robots that are guided by cameras.

>>> Pose.at(0, 0, 1).position
array([0., 0., 1.])
"""

import importlib
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

from robsim import examples as examples
from robsim import robots as robots
from robsim import units as units
from robsim.camera import Camera as Camera
from robsim.camera import Visibility as Visibility
from robsim.errors import FileError as FileError
from robsim.errors import FrameError as FrameError
from robsim.errors import GoalError as GoalError
from robsim.errors import InputError as InputError
from robsim.errors import Interrupted as Interrupted
from robsim.errors import RankWarning as RankWarning
from robsim.errors import RobSimError as RobSimError
from robsim.errors import UnitError as UnitError
from robsim.features import Observation as Observation
from robsim.features import PixelPoints as PixelPoints
from robsim.features import Points as Points
from robsim.outcome import Outcome as Outcome
from robsim.pose import Pose as Pose
from robsim.primitives import Block as Block
from robsim.primitives import CameraBody as CameraBody
from robsim.primitives import Wheel as Wheel
from robsim.robot import Link as Link
from robsim.robot import Robot as Robot
from robsim.scene import Mounted as Mounted
from robsim.scene import Object as Object
from robsim.scene import Scene as Scene
from robsim.servo import IBVS as IBVS
from robsim.servo import CameraLaw as CameraLaw
from robsim.servo import Computed as Computed
from robsim.servo import Damped as Damped
from robsim.servo import JointLaw as JointLaw
from robsim.servo import Shown as Shown
from robsim.servo import State as State
from robsim.servo import Truncated as Truncated
from robsim.simulate import simulate as simulate
from robsim.tree import Joint as Joint

if TYPE_CHECKING:
    from robsim import plot as plot
    from robsim.results import open_run as open_run
    from robsim.results import save_run as save_run
    from robsim.scenario import Scenario as Scenario
    from robsim.scenario import load_scenario as load_scenario
    from robsim.scenario import replay as replay

# what needs xarray, pydantic or matplotlib is imported when it is first used
_LAZY = {
    "plot": "robsim.plot",
    "open_run": "robsim.results",
    "save_run": "robsim.results",
    "Scenario": "robsim.scenario",
    "load_scenario": "robsim.scenario",
    "replay": "robsim.scenario",
}


def __getattr__(name: str) -> Any:
    if name not in _LAZY:
        raise AttributeError(f"module 'robsim' has no attribute {name!r}")
    module = importlib.import_module(_LAZY[name])
    return module if name == "plot" else getattr(module, name)


def __dir__() -> list[str]:
    inside = {"Any", "TYPE_CHECKING", "importlib"}
    return sorted({*globals(), *_LAZY} - inside)
