"""A package of a ROS 2 workspace; RobSim itself is installed with pip (see docs/ros2.md)."""

from setuptools import setup

NAME = "robsim_ros"
SHARE = f"share/{NAME}"

setup(
    name=NAME,
    version="0.2.0",
    packages=[NAME],
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (SHARE, ["package.xml"]),
        (f"{SHARE}/launch", ["launch/cell.launch.xml"]),
        (f"{SHARE}/config", ["config/cell.toml", "config/parameters.yaml"]),
    ],
    install_requires=["setuptools"],
    zip_safe=True,
    maintainer="The RobSim developers",
    maintainer_email="robsim@example.org",
    description="Nodes of RobSim: a simulated robot cell, and a controller guided by cameras",
    license="BSD-3-Clause",
    entry_points={
        "console_scripts": [f"{name} = {NAME}.nodes:{name}" for name in ("play", "drive")]
    },
)
