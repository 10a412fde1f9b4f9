"""The public names: those of `robsim`, and those of its modules by subject."""

import inspect

import robsim as rs


def public_objects():
    """Yield the module, the name and the value of each public class and function."""
    for module in ["robsim", *(n for n in dir(rs) if inspect.ismodule(getattr(rs, n)))]:
        door = rs if module == "robsim" else getattr(rs, module)
        for name in getattr(door, "__all__", None) or dir(door):
            value = getattr(door, name)
            ours = str(getattr(value, "__module__", "")).startswith("robsim")
            if not name.startswith("_") and ours and callable(value):
                yield module, name, value
