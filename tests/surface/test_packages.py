"""The wheel, the source distribution, and the folders for an installation without a network.

It takes a minute, and needs a package index and the tools `build`, `hatchling`, `twine` and `uv`:
pytest -n 0 -m wheel tests/surface/test_packages.py
"""

import os
import re
import shutil
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

pytestmark = pytest.mark.wheel
ROOT = Path(__file__).parents[2]
OFFLINE = ROOT / "docs/howto/offline.md"
HERE = f"{sys.version_info.major}.{sys.version_info.minor}"
SYSTEMS = {
    "windows": "x86_64-pc-windows-msvc",
    "macos": "aarch64-apple-darwin",
    "linux": "x86_64-manylinux_2_28",
}
PACKAGE_DATA = {".py", ".pyi", ".typed", ".toml", ".csv", ".css", ".html", ".js", ".json"}
PICTURES = {".png", ".webp"}


def call(*command, cwd=None, **environment):
    """Run a command outside of the environment of the tests; return its output."""
    hidden = {"PYTHONPATH", "PYTEST_CURRENT_TEST", "VIRTUAL_ENV"}
    inherited = {k: v for k, v in os.environ.items() if k not in hidden}
    done = subprocess.run(
        list(map(str, command)),
        check=False,
        capture_output=True,
        encoding="utf-8",
        cwd=cwd,
        env=inherited | environment,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    """The committed files, in a folder with blanks and umlauts, without traces of other work."""
    folder = tmp_path_factory.mktemp("Übung 1 (Ä ö)")
    archive = folder / "archive.tar"
    call("git", "archive", "-o", archive, "HEAD", cwd=ROOT)
    with tarfile.open(archive) as file:
        file.extractall(folder, filter="data")
    archive.unlink()
    return folder


@pytest.fixture(scope="module")
def packages(copy, tmp_path_factory):
    """The source distribution and the wheel that is built from it."""
    out = tmp_path_factory.mktemp("dist")
    call(sys.executable, "-m", "build", "--no-isolation", "-o", out, cwd=copy)
    (sdist,), (wheel,) = out.glob("*.tar.gz"), out.glob("*.whl")
    return sdist, wheel


@pytest.fixture(scope="module")
def kit(copy):
    """The folder that the commands of the page write, for this version of Python."""
    (block,) = re.findall(r"```sh\n(.*?)```", OFFLINE.read_text(encoding="utf-8"), re.DOTALL)
    block = block.replace("--python-version 3.13", f"--python-version {HERE}")
    for line in block.splitlines():
        assert line.startswith(("pip wheel ", "pip download ")), line
        call(sys.executable, "-m", *line.split(), "-q", cwd=copy)
    return copy / "kit"


def test_the_metadata_are_valid(packages, copy):
    call(sys.executable, "-m", "twine", "check", "--strict", *packages)
    assert "are valid" in call("uvx", "--quiet", "cffconvert", "--validate", cwd=copy)


def test_the_source_distribution_has_every_committed_file(packages):
    with tarfile.open(packages[0]) as file:
        found = {name.partition("/")[2] for name in file.getnames()}
    committed = set(call("git", "ls-tree", "-rz", "--name-only", "HEAD", cwd=ROOT).split("\0"))
    assert found == (committed - {""}) | {"PKG-INFO"}


def test_the_wheel_has_the_package_alone(packages):
    assert packages[1].name.endswith("-py3-none-any.whl")
    committed = call("git", "ls-tree", "-rz", "--name-only", "HEAD:src", cwd=ROOT).split("\0")
    with zipfile.ZipFile(packages[1]) as file:
        names = [name for name in file.namelist() if ".dist-info/" not in name]
        size = sum(each.compress_size for each in file.infolist())
    assert sorted(names) == sorted(filter(None, committed))
    assert {Path(name).suffix for name in names} == PACKAGE_DATA | PICTURES
    assert size < 4e6


def list_pythons():
    """The interpreters of this machine from Python 3.11 on; `ROBSIM_PYTHONS` names more."""
    named = os.environ.get("ROBSIM_PYTHONS", "").split(os.pathsep)
    candidates = [shutil.which(f"python3.{minor}") for minor in range(11, 15)] + named
    return [path for path in filter(None, candidates) if subprocess.call([path, "-V"]) == 0]


def test_the_wheel_runs_without_a_compiler_on_every_python_of_this_machine(packages):
    out = call(ROOT / ".ci/try_wheel", packages[1], *(list_pythons() or [sys.executable]))
    assert "converged" in out


def test_the_folders_of_all_systems_are_complete(kit, tmp_path):
    """A second program resolves the folders, with the conditions of their systems."""
    assert {path.name for path in kit.iterdir() if path.is_dir()} == set(SYSTEMS)
    for name, system in SYSTEMS.items():
        target = ("--dry-run", "--target", tmp_path / name, "--python-platform", system)
        source = ("--no-index", "--find-links", kit / name, "--no-build", "--no-config")
        call("uv", "pip", "install", *target, *source, "--python-version", HERE, "robsim")


@pytest.mark.skipif(sys.platform != "linux", reason="needs unshare, of Linux")
def test_the_folder_for_linux_installs_without_a_network(kit, tmp_path):
    call(sys.executable, "-m", "venv", tmp_path / "course")
    pip = [tmp_path / "course/bin/python", "-m", "pip", "--isolated"]
    offline = ["unshare", "--net", "--map-root-user"]
    call(*offline, *pip, "install", "--no-index", "--find-links", kit / "linux", "robsim")
    demo = [tmp_path / "course/bin/robsim", "demo", "--no-open", "-o", "Ergebnis ü"]
    assert "converged" in call(*offline, *demo, cwd=tmp_path)
