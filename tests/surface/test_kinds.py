"""The kinds of a family are found in their files, and a kind is imported when it is needed."""

import json
import pkgutil
import subprocess
import sys
from importlib import import_module

import pytest

import robsim
from robsim.declare import families, family


def test_the_files_of_a_family_list_its_kinds():
    for module in pkgutil.walk_packages(robsim.__path__, "robsim."):
        import_module(module.name)
    for noun, each in families().items():
        own = {
            name: (kind.__module__, kind.__qualname__)
            for name, kind in each.loaded.items()
            if kind.__module__.startswith("robsim.")
        }
        assert own == each.shipped, noun
    assert {"points", "polar"} < family("feature").shipped.keys()
    assert family("task").shipped["mission"] == ("robsim.run.mission", "Mission")


MEASURED = """
import json, sys, time
import robsim, numpy
begun = time.process_time()
{code}
spent = time.process_time() - begun
print(json.dumps([spent, [name for name in sys.modules if name.startswith("robsim.")]]))
"""


def loaded_by(code):
    """CPU seconds and the modules of RobSim that a fresh Python loads for some code."""
    done = subprocess.run(
        [sys.executable, "-c", MEASURED.format(code=code)],
        capture_output=True,
        check=True,
        text=True,
    )
    return json.loads(done.stdout)


@pytest.mark.parametrize("noun", ["feature", "law", "joint kind", "task"])
def test_a_users_kind_loads_hardly_more_than_the_declarations(noun):
    """21 modules and 0.03 s of CPU beyond NumPy; once it was 383 and 0.5 s."""
    code = f"from robsim.declare import register\n@register({noun!r}, 'mine')\nclass Mine: pass"
    spent, modules = loaded_by(code)
    assert len(modules) < 60 and not any(".kernels." in name for name in modules)
    assert spent < 0.1


def test_one_kind_loads_its_own_file_alone():
    code = "from robsim.declare import family\nfamily('feature').find('points')"
    _, modules = loaded_by(code)
    features = {f"robsim.features.{name}" for name in ("points", "polar", "ellipse", "moments")}
    assert features & set(modules) == {"robsim.features.points"}
    assert not any(name.startswith(("robsim.servo", "robsim.run")) for name in modules)


def test_a_feature_is_an_attribute_of_the_room_of_features():
    import robsim.features as room

    for name, source in family("feature").shipped.items():
        assert getattr(room, source.name) is family("feature").find(name)
    with pytest.raises(AttributeError, match="no feature 'Nothing'"):
        _ = room.Nothing
