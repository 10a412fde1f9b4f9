"""Families: named kinds of features, laws, tasks and other exchangeable parts.

`kinds.toml` lists the files with the kinds of RobSim for each family; they are imported when they
are needed. The decorator `register` adds a user's kind to a family. An installed package may offer
registered classes as entry points of the group "robsim".
"""

from __future__ import annotations

import dataclasses
import inspect
import re
import tomllib
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache, cached_property
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any, NamedTuple, TypeVar

from robsim.base.errors import InputError, format_value, suggest_names
from robsim.base.name_check import check_name
from robsim.declare.error_phrases import pluralize
from robsim.declare.parameter_docs import described
from robsim.declare.scalars import Flag, Integer, Number
from robsim.declare.texts import Text

K = TypeVar("K", bound=type[Any])
PACKAGE = Path(__file__).parents[1]
PLAIN_FIELDS = {"float": Number(), "int": Integer(-(2**53)), "bool": Flag(), "str": Text()}
_REGISTERED = re.compile(r'^@register\("([^"]+)", "(\w+)"\)$.*?^class (\w+)', re.M | re.S)


class KindSource(NamedTuple):
    """The module and the class of a kind."""

    module: str
    name: str


@dataclass(eq=False)
class KindFamily:
    """The kinds of one family, such as "feature" or "law" (its `noun`)."""

    noun: str
    files: tuple[str, ...] = ()  # patterns of the files with the kinds of RobSim
    loaded: dict[str, type[Any]] = field(default_factory=dict)

    @cached_property
    def shipped(self) -> dict[str, KindSource]:
        """The sources of RobSim's kinds by name, read from their files without an import."""
        paths = [path for pattern in self.files for path in sorted(PACKAGE.glob(pattern))]
        return {
            name: KindSource(_get_module_name(path), kind)
            for path in paths
            for noun, name, kind in _REGISTERED.findall(path.read_text(encoding="utf-8"))
            if noun == self.noun
        }

    @property
    def names(self) -> list[str]:
        """The names of all kinds: RobSim's own, then the others in order of registration."""
        return list(dict.fromkeys([*self.shipped, *self.loaded]))

    @property
    def kinds(self) -> dict[str, type[Any]]:
        """All kinds by name. Access imports them."""
        return {name: self.find(name) for name in self.names}

    def get(self, name: str) -> type[Any] | None:
        """Return the class of a name; None if it is not registered yet."""
        if name not in self.loaded and name in self.shipped:
            import_module(self.shipped[name].module)
        return self.loaded.get(name)

    def find(self, name: object) -> type[Any]:
        """Return the class of a name; InputError with the nearest and all names."""
        key = name if isinstance(name, str) else ""
        kind = self.get(key)
        if kind is None:
            _load_entry_points()
            kind = self.get(key)
        if kind is None:
            hint = suggest_names(str(name)[:64], self.names, pluralize(self.noun))
            raise InputError(f"no {self.noun} {format_value(name)}; {hint}")
        return kind

    def name_of(self, value: object) -> str | None:
        """Return the name of the class of a value; None if it does not belong to the family."""
        names = (name for name, kind in self.loaded.items() if type(value) is kind)
        return next(names, None)


def _get_module_name(path: Path) -> str:
    return ".".join([PACKAGE.name, *path.relative_to(PACKAGE).with_suffix("").parts])


def _read_shipped_families() -> dict[str, KindFamily]:
    listed = tomllib.loads((PACKAGE / "kinds.toml").read_text(encoding="utf-8"))
    return {noun: KindFamily(noun, tuple(files)) for noun, files in listed.items()}


_FAMILIES = _read_shipped_families()


def family(noun: str) -> KindFamily:
    """Return the family with a noun, such as "law"; a new family if there is none.

    >>> family("law").find("joint").__name__
    'JointLaw'
    """
    return _FAMILIES.setdefault(noun, KindFamily(noun))


def families() -> dict[str, KindFamily]:
    """Return all families by their nouns.

    >>> {"feature", "law", "task"} <= set(families())
    True
    """
    return dict(_FAMILIES)


def register(noun: str, name: str | None = None) -> Callable[[K], K]:
    """Return a decorator that registers a class as a kind of a family.

    A registered class can be used by its name in Python, scenario files, changes and saved runs.
    Fields with the plain types float, int, bool and str are declared without bounds and meaning.
    The decorator also adds the declared fields to the docstring, as `described` does.

    Parameters
    ----------
    noun : str
        Family, such as "feature".
    name : str, optional
        Name of the kind. Default: the attribute `name` of the class.

    Returns
    -------
    callable
        The decorator, which returns the class.

    Raises
    ------
    InputError
        If the family does not exist, if the name is not valid, if another class has it, or if a
        dataclass has an `__init__` that does not take its fields.

    Examples
    --------
    >>> register("featur", "mine")(type("Mine", (), {}))
    Traceback (most recent call last):
    ...
    robsim.base.errors.InputError: no family 'featur'; did you mean 'feature'? ...
    """

    def named(kind: K) -> K:
        if not isinstance(kind, type):
            raise InputError(f"{noun}: expected a class, got {format_value(kind)}")
        own = check_name(getattr(kind, "name", None) if name is None else name, noun)
        if noun not in _FAMILIES:
            raise InputError(
                f"no family {format_value(noun)}; {suggest_names(noun, _FAMILIES, 'families')}"
            )
        known = _FAMILIES[noun].get(own)
        if known is not None and known.__qualname__ != kind.__qualname__:
            raise InputError(f"there is a {noun} {own!r} already: {known.__qualname__}")
        if dataclasses.is_dataclass(kind) and not kind.__module__.startswith(f"{PACKAGE.name}."):
            _declare_plain_fields(kind)
        _FAMILIES[noun].loaded[own] = kind
        return described(kind)

    return named


def _declare_plain_fields(kind: type[Any]) -> None:
    """Declare the fields of a user's dataclass with a plain type; InputError if it takes no fields.

    An object that is read from a text is made from its fields.
    """
    every = [each for each in dataclasses.fields(kind) if each.init]
    try:
        inspect.signature(kind).bind_partial(**{each.name: None for each in every})
    except TypeError as error:
        raise InputError(f"{kind.__name__}.__init__ does not take its fields: {error}") from None
    for each in every:
        spec = PLAIN_FIELDS.get(getattr(each.type, "__name__", str(each.type)))
        if spec and each.name in kind.__annotations__:
            kind.__annotations__[each.name] = Annotated[each.type, spec]


def make_kind_getattr(noun: str) -> Callable[[str], type[Any]]:
    """Return the `__getattr__` of a package that exports the kinds of a family by class name."""

    def named(attribute: str) -> type[Any]:
        for name, source in family(noun).shipped.items():
            if source.name == attribute:
                return family(noun).find(name)
        raise AttributeError(f"no {noun} {attribute!r}")

    return named


@cache
def _load_entry_points() -> None:
    """Import the kinds of installed packages, once; their decorators register them."""
    from importlib.metadata import entry_points

    for point in entry_points(group="robsim"):
        point.load()
