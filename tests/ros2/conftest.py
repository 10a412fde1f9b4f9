"""Nodes of ROS 2 in processes of their own: `pip install '.[ros2]'`, then `pytest tests/ros2`.

Without rclpy no test of this folder is collected, and pytest reports it on top.
"""

import importlib.util
import os
import warnings

import pytest
from ros_cells import braking_experiment
from ros_processes import Listener, RosProcess

LACKING = importlib.util.find_spec("rclpy") is None
collect_ignore_glob = ["test_*.py"] if LACKING else []
DOMAINS = range(46, 101)  # beyond 101 the ports of a domain meet those of other programs

if not LACKING:
    with warnings.catch_warnings(action="ignore"):  # its parser imports a deprecated module
        import rosidl_generator_py  # noqa: F401


def pytest_report_header():
    return "tests/ros2: left out (without rclpy)" if LACKING else None


@pytest.fixture(scope="session")
def domain(worker_id):
    """The domain of this worker: no other worker of this machine is in it."""
    number = int(worker_id.removeprefix("gw")) if worker_id != "master" else 0
    return DOMAINS[(os.getppid() * 7 + number) % len(DOMAINS)]


@pytest.fixture(scope="session")
def ros_environment(domain):
    """Only this machine and this domain are reached, by this process and those it starts."""
    told = {"ROS_DOMAIN_ID": str(domain), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
    with pytest.MonkeyPatch.context() as patch:
        for name, value in told.items():
            patch.setenv(name, value)
        yield told


def start_processes(ros_environment):
    """`start(ARGUMENTS)`: a Python process, such as `start("-m", "robsim", "--version")`."""
    started = []

    def begin(*arguments, **environment):
        started.append(RosProcess(*arguments, **environment))
        return started[-1]

    yield begin
    for process in reversed(started):
        process.kill()
        print(f"{process.name} wrote:\n{process.text}")  # which pytest shows with a failure


def start_robsim(start):
    """`robsim(ARGUMENTS)`: the command in a process of its own."""
    return lambda *arguments, **more: start("-m", "robsim", *arguments, **more)


def join_domain(ros_environment, domain):
    """A node in this process."""
    found = Listener(domain)
    yield found
    found.close()


start, start_long = (
    pytest.fixture(start_processes, name=name, scope=scope)
    for name, scope in (("start", "function"), ("start_long", "module"))
)
listener, listener_long = (
    pytest.fixture(join_domain, name=name, scope=scope)
    for name, scope in (("listener", "function"), ("listener_long", "module"))
)


@pytest.fixture
def robsim(start):
    return start_robsim(start)


@pytest.fixture(scope="module")
def robsim_long(start_long):
    """As `robsim`, for processes that several tests of a file share."""
    return start_robsim(start_long)


@pytest.fixture(scope="session")
def braking_cell(tmp_path_factory):
    """An experiment that brakes within limits, and its file."""
    experiment, path = braking_experiment(), tmp_path_factory.mktemp("braking") / "cell.toml"
    path.write_text(experiment.to_toml(), encoding="utf-8")
    return experiment, path
