"""Weightings of feature points: image border, fading, robust M-estimators."""

from robsim.servo.weightings.border import Border as Border
from robsim.servo.weightings.fade import Fade as Fade
from robsim.servo.weightings.robust_weightings import Cauchy as Cauchy
from robsim.servo.weightings.robust_weightings import Huber as Huber
from robsim.servo.weightings.robust_weightings import Tukey as Tukey
