from robsim.starts.start_samplers import About as About
from robsim.starts.start_samplers import Anywhere as Anywhere
from robsim.starts.start_samplers import LookAt as LookAt
from robsim.starts.start_samplers import Shell as Shell
from robsim.starts.start_samplers import Within as Within
