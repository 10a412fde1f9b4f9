"""Example scenarios, one TOML file each; the command `robsim examples` lists and copies them."""

from robsim.files.examples import names as names
from robsim.files.examples import path as path
