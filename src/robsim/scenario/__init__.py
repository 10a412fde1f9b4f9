"""Scenarios: a scene, a task and a run in one TOML file, read strictly.

What is wrong in a file is one `FileError` that names the file, the key and what would be valid.
"""

from robsim.scenario.repeat import replay as replay
from robsim.scenario.robot_file import read_robot as read_robot
from robsim.scenario.run import Settings as Settings
from robsim.scenario.scenario import Scenario as Scenario
from robsim.scenario.scenario import load_scenario as load_scenario
