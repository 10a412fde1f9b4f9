"""The package of a ROS 2 workspace: its manifest, its build as colcon does it, and its files."""

import os
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest

import robsim as rs

PACKAGE = Path(__file__).parents[2] / "ros2/robsim_ros"
catkin = pytest.importorskip("catkin_pkg.package", reason="needs catkin_pkg")  # PyPI


@pytest.fixture(scope="module")
def manifest():
    found = catkin.parse_package(PACKAGE)
    found.validate()
    return found


def test_the_manifest_is_valid_and_has_the_version_and_the_license_of_robsim(manifest):
    assert (manifest.name, manifest.version) == ("robsim_ros", rs.__version__)
    assert manifest.get_build_type() == "ament_python" and manifest.licenses == ["BSD-3-Clause"]


def test_the_manifest_names_the_packages_of_every_imported_message(manifest):
    pyproject = (PACKAGE.parents[1] / "pyproject.toml").read_text(encoding="utf-8")
    extra = pyproject.partition("\nros2 = [")[2].partition("]\n")[0]
    wheels = {line.split('"')[1].partition(">")[0] for line in extra.splitlines() if "ros-" in line}
    wanted = {w.removeprefix("ros-").replace("-", "_") for w in wheels} - {"rmw_fastrtps_cpp"}
    assert wanted <= {each.name for each in manifest.exec_depends}


def test_it_builds_and_its_executables_are_the_commands(tmp_path):
    source, prefix = tmp_path / "source", tmp_path / "install"
    subprocess.run(["cp", "-r", PACKAGE, source], check=True)
    build = ["setup.py", "-q", "install", "--prefix", prefix, "--record", tmp_path / "record"]
    build += ["--single-version-externally-managed"]
    done = subprocess.run(
        [sys.executable, *build], cwd=source, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    share = prefix / "share"
    assert (share / "ament_index/resource_index/packages/robsim_ros").is_file()
    for file in ("package.xml", "launch/cell.launch.xml", "config/cell.toml"):
        assert (share / "robsim_ros" / file).is_file()
    (packages,) = prefix.glob("lib/python3*/site-packages")
    path = os.pathsep.join([str(packages), os.environ.get("PYTHONPATH", "")])
    for name in ("play", "drive"):
        call = [prefix / "lib/robsim_ros" / name, "--help"]
        told = subprocess.run(
            call,
            env={**os.environ, "PYTHONPATH": path},
            capture_output=True,
            text=True,
            check=False,
        )
        assert f"ros2 {name}" in told.stdout, told.stderr


def test_the_launch_file_starts_executables_with_files_of_the_package():
    root = ElementTree.parse(PACKAGE / "launch/cell.launch.xml").getroot()
    assert [node.get("exec") for node in root.iter("node")] == ["play", "drive"]
    for each in root.iter("arg"):
        place = each.get("default").removeprefix("$(find-pkg-share robsim_ros)/")
        assert place == "true" or (PACKAGE / place).is_file()


def test_the_cell_of_the_package_converges():
    run = rs.load_scenario(PACKAGE / "config/cell.toml").run()
    assert int(run.outcome) == rs.Outcome.CONVERGED
