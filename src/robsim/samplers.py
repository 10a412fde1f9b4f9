"""Samplers of numbers and choices that vary between the runs of a study."""

from robsim.studies.samplers import Choice as Choice
from robsim.studies.samplers import LogUniform as LogUniform
from robsim.studies.samplers import Normal as Normal
from robsim.studies.samplers import Product as Product
from robsim.studies.samplers import Sampler as Sampler
from robsim.studies.samplers import Sobol as Sobol
from robsim.studies.samplers import Sum as Sum
from robsim.studies.samplers import TabulatedValues as TabulatedValues
from robsim.studies.samplers import Uniform as Uniform
from robsim.studies.value_grid import Grid as Grid
