"""The public surface: names, the order of arguments, docstrings, and the content of the package."""

import ast
import importlib
import importlib.metadata
import inspect
from pathlib import Path

import click
import pytest
from front_door import public_objects

import robsim as rs
from robsim import page, plot
from robsim.cli import commands

PACKAGE = Path(rs.__file__).parent
CLASSIC = [
    *("init_block", "init_circ", "init_cam", "move_block", "move_circ", "move_cam"),
    *("plot_block", "plot_circ", "plot_cam", "point_view"),
]
SIGNATURES = {
    "Pose.at": "x y z rpy rotvec frames",
    "Pose": "matrix frames",
    "Block": "length width height color pose",
    "Wheel": "radius width n color pose",
    "CameraBody": "length width height color pose",
    "shapes.Ball": "radius n color pose",
    "shapes.Capsule": "radius length n color pose",
    "shapes.TaperedCylinder": "radius end_radius length n color pose",
    "shapes.Mesh": "filename scale color pose",
    "shapes.Inertia": "mass centre tensor",
    "Camera": "K size body distortion lens",
    "Camera.from_chapter": "f px py alpha u0 v0 size body",
    "Camera.project": "self points T_w_c",
    "Camera.from_file": "path name lens",
    "Camera.to_file": "self path",
    "Camera.from_ros": "message rectified",
    "Camera.resized": "self width height stretch",
    "Camera.cropped": "self left top width height",
    "MountedCamera.rig_from_file": "path on pose",
    "vision.Tag": "family id size",
    "vision.Board": "family columns rows square tag",
    "vision.TagDetector": "targets",
    "vision.render_targets": "camera targets samples",
    "Robot.from_dh": "rows convention joints home limits name",
    "Robot.from_urdf": "path",
    "Robot.to_urdf": "self path",
    "Robot.to_mjcf": "self path",
    "Robot.fk": "self q link",
    "Robot.frames": "self q",
    "Robot.jacobian": "self q link",
    "Robot.ik": "self T q0 link mask tolerance iterations restarts seed limits threads",
    "Robot.closed_ik": "self T link tolerance",
    "Scene": "robots objects cameras display",
    "Scene.view": "self q camera points",
    "IBVS": "goal camera target features",
    "FollowJoints": "to trajectory joints duration speed acceleration",
    "FollowPath": "to path frame mask duration speed acceleration turn",
    "trajectory.Quintic": "start end duration",
    "trajectory.Trapezoid": "start end speed acceleration",
    "trajectory.Blends": "points speed acceleration corner",
    "trajectory.Straight": "start end duration speed acceleration turn",
    "simulate": "scene task q0 dt duration seed",
    "kinematics.clearance": "scene q one other",
    "compare": "scene tasks q0",
    "load_scenario": "path",
    "save_run": "run path",
    "open_run": "path",
    "logs.write_bag": "run path experiment storage start",
    "logs.read_bag": "path experiment topics names marks frames clock",
    "logs.read_bag_images": "path topic",
    "logs.read_log": "path experiment columns units",
    "plot.save_film": "run path experiment",
    "plot.scene": "scene",
    "plot.image": "run",
    "plot.velocity": "run",
    "plot.run": "run scene",
    "plot.comparison": "comparison",
    "plot.diagnosis": "diagnosis",
    "plot.moments": "scene q titles",
    "plot.robot": "robot q",
    "plot.workspace": "workspace",
    "plot.study": "study x y color",
    "plot.study_basin": "study x y by",
    "plot.study_success": "study x by bins",
    "plot.study_map": "study x y bins",
    "plot.study_distributions": "study measures by among",
    "plot.study_sensitivity": "study of",
    "diagnose": "run experiment",
    "explain": "run experiment trials",
    "kinematics.manipulability": "robot q link axes length",
    "kinematics.singularity_distance": "robot q link axes length",
    "kinematics.condition_number": "robot q link axes length",
    "kinematics.sample_workspace": "robot count seed link axes length",
    "robots.names": "",
    "robots.load": "name",
    "units.parse": "text dimension",
}
MEMBERS = {
    "Pose": "matrix position rotation quaternion rotvec inv exp",
    "Block": "vertices edges faces at",
    "Robot": "nq nv limits fk frames jacobian",
    "Outcome": "CONVERGED LOCAL_MINIMUM OUT_OF_IMAGE BEHIND_CAMERA JOINT_LIMIT SINGULAR DIVERGED "
    "NOT_FINITE TIME_LIMIT message",
    "Camera": "project visibility normalise from_chapter",
}


def exported():
    """The names that the package and its modules hand on, with their names at their sources."""
    doors = [path for path in PACKAGE.glob("*.py") if path.stem not in WITH_OWN_NAMES]
    for path in [*PACKAGE.glob("*/__init__.pyi"), PACKAGE / "__init__.pyi", *doors]:
        module = path.parent.stem if path.name == "__init__.pyi" else path.stem
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.ImportFrom) and str(node.module).startswith("robsim"):
                yield from ((module, alias.name, alias.asname) for alias in node.names)


WITH_OWN_NAMES = ("__init__", "__main__", "classic", "container", "robots", "testing", "units")
EXPORTED = sorted({(module, name) for module, name, _ in exported()})
NAMES = [name if module == "robsim" else f"{module}.{name}" for module, name in EXPORTED]


def value(path):
    assert page  # a module that the package does not list
    found = rs
    for name in path.split("."):
        found = getattr(found, name)
    return found


CLASSES = [name for name in NAMES if inspect.isclass(value(name))]


def test_every_name_is_handed_on_as_it_is():
    for _, name, public in exported():
        assert public == name and not name.startswith("_")
    assert len(NAMES) > 250 and {n for n in NAMES if "." not in n} == set(dir(rs))


@pytest.mark.parametrize("name", NAMES)
def test_every_public_name_has_a_docstring(name):
    found = value(name)
    text = inspect.getdoc(found)
    assert text and text.strip().split("\n")[0].rstrip().endswith((".", ":", ")"))
    assert not text.startswith(
        f"{name.split('.')[-1]}("
    )  # a dataclass writes such a docstring by default


@pytest.mark.parametrize("name", CLASSES)
def test_every_public_member_of_a_class_has_a_docstring(name):
    for member, found in vars(value(name)).items():
        described = isinstance(found, property | classmethod) or inspect.isfunction(found)
        described |= type(found).__name__ == "cached_property"
        if described and not member.startswith("_"):
            assert inspect.getdoc(getattr(found, "__func__", found)), f"{name}.{member}"


@pytest.mark.parametrize("path", SIGNATURES)
def test_a_name_that_users_rely_on_is_there_with_its_arguments_in_order(path):
    given = list(inspect.signature(inspect.unwrap(value(path))).parameters)
    wanted = SIGNATURES[path].split()
    assert [name for name in given if name in wanted] == wanted


@pytest.mark.parametrize("name", MEMBERS)
def test_a_member_that_users_rely_on_is_there(name):
    assert all(hasattr(getattr(rs, name), member) for member in MEMBERS[name].split())


def test_the_defaults_of_a_run_agree_with_the_documentation():
    given = inspect.signature(rs.simulate).parameters
    defaults = {name: given[name].default for name in ("q0", "dt", "duration", "seed", "sensing")}
    assert defaults == {"q0": None, "dt": 0.04, "duration": 10.0, "seed": 0, "sensing": None}


def test_robots_of_the_library_are_functions_by_name():
    for name in rs.robots.names():
        assert getattr(rs.robots, name)().name == name and name in dir(rs.robots)
    with pytest.raises(
        AttributeError, match="no robot 'rhino' in the library; robots: car, conveyor"
    ):
        _ = rs.robots.rhino


def test_a_name_that_is_not_there_is_an_attribute_error():
    with pytest.raises(AttributeError, match="module 'robsim' has no attribute 'simulat'"):
        _ = rs.simulat
    assert not hasattr(rs, "_private")


def test_classic_gives_exactly_the_ten_names_of_the_chapter():
    space = {}
    exec("from robsim.classic import *", space)
    assert sorted(set(space) - {"__builtins__"}) == sorted(CLASSIC)
    for name in CLASSIC:
        assert inspect.getdoc(space[name])


def test_plot_gives_its_functions():
    assert rs.plot is plot
    assert {"comparison", "diagnosis", "scene", "image", "velocity", "run"} <= set(dir(plot))


def test_the_command_line_has_its_commands_with_a_sentence_each():
    assert isinstance(commands.cli, click.Group)
    assert {"demo", "run", "compare", "check", "robots", "examples"} <= set(commands.cli.commands)
    for command in commands.cli.commands.values():
        assert command.help and command.help.split("\n")[0].endswith(".")


def test_the_version_agrees_with_the_package():
    assert importlib.metadata.version("robsim") == rs.__version__


def test_types_robots_and_examples_are_packaged():
    assert (PACKAGE / "py.typed").is_file()
    assert rs.robots.names() and all(rs.robots.file(name).is_file() for name in rs.robots.names())
    examples = importlib.import_module("robsim.files.examples")
    assert examples.names() and all(examples.path(name).is_file() for name in examples.names())


def test_robsim_is_the_command_and_the_module():
    scripts = importlib.metadata.entry_points(group="console_scripts", name="robsim")
    assert [script.value for script in scripts] == ["robsim.cli:main"]
    assert (PACKAGE / "__main__.py").is_file()


def test_no_signature_shows_specs_or_meanings():
    for module, name, found in public_objects():
        if not inspect.isclass(found) or found.__init__ is object.__init__:
            continue
        shown = f"{inspect.signature(found.__init__)}"
        assert "Annotated[" not in shown, f"{module}.{name}"


def typed_constructors():
    """Yield the classes with an `__init__` for type checkers, and its syntax tree."""
    texts = {path: path.read_text(encoding="utf-8") for path in sorted(PACKAGE.rglob("*.py"))}
    for path in (path for path, text in texts.items() if "    if TYPE_CHECKING:" in text):
        for kind in ast.walk(ast.parse(texts[path])):
            for part in kind.body if isinstance(kind, ast.ClassDef) else ():
                typed = isinstance(part, ast.If) and ast.unparse(part.test) == "TYPE_CHECKING"
                for each in part.body if typed else ():
                    if isinstance(each, ast.FunctionDef) and each.name == "__init__":
                        module = ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts)
                        yield getattr(importlib.import_module(module), kind.name), each


@pytest.mark.parametrize(("kind", "written"), list(typed_constructors()))
def test_a_constructor_for_type_checkers_has_the_arguments_of_the_class(kind, written):
    """The types are wider; names, order, keyword-only arguments and defaults are the same."""
    real = list(inspect.signature(kind.__init__).parameters.values())[1:]
    arguments = written.args
    positional = [each.arg for each in arguments.args[1:]]
    keyword = [each.arg for each in arguments.kwonlyargs]
    assert [p.name for p in real if p.kind is not p.KEYWORD_ONLY] == positional
    assert [p.name for p in real if p.kind is p.KEYWORD_ONLY] == keyword
    without = positional[: len(positional) - len(arguments.defaults)]
    pairs = zip(keyword, arguments.kw_defaults, strict=True)
    without += [name for name, default in pairs if default is None]
    assert [p.name for p in real if p.default is p.empty] == without
