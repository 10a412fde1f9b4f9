"""Visual features that a controller regulates, each imported at its first use."""

from typing import Any

from robsim.base.lazy_names import attach_names
from robsim.declare.kind_families import make_kind_getattr

_import_listed, __dir__, __all__ = attach_names(__name__, __file__)
_find_feature = make_kind_getattr("feature")


def __getattr__(name: str) -> Any:
    """Return a name that the stub lists, or a feature that another file of this folder defines."""
    return _import_listed(name) if name in __dir__() else _find_feature(name)
