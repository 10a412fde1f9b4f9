"""Errors and warnings of RobSim; `RobSimError` is the base class of all errors."""

from robsim.base.errors import CodeError as CodeError
from robsim.base.errors import FileError as FileError
from robsim.base.errors import FileWarning as FileWarning
from robsim.base.errors import FitWarning as FitWarning
from robsim.base.errors import FrameError as FrameError
from robsim.base.errors import GoalError as GoalError
from robsim.base.errors import InputError as InputError
from robsim.base.errors import Interrupted as Interrupted
from robsim.base.errors import ParameterError as ParameterError
from robsim.base.errors import RankWarning as RankWarning
from robsim.base.errors import ReplayWarning as ReplayWarning
from robsim.base.errors import RobSimError as RobSimError
from robsim.base.errors import UnitError as UnitError
from robsim.base.errors import UnitWarning as UnitWarning
