from robsim.trajectory.blends import Blends as Blends
from robsim.trajectory.path import Path as Path
from robsim.trajectory.quintic import Quintic as Quintic
from robsim.trajectory.straight import Straight as Straight
from robsim.trajectory.trapezoid import Trapezoid as Trapezoid
