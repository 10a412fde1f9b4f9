"""The reference pages: every public name by module, and every command of the command line."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Iterator
from enum import Enum
from functools import cache, partial
from textwrap import dedent
from types import ModuleType
from typing import Any

import click

import robsim as rs
from robsim.cli.commands import cli
from robsim.declare.parameter_docs import TypeText, format_type

SECTION = re.compile(r"^(\w[\w ]*)\n-{3,}\n", re.M)
LISTS = {"Parameters", "Attributes", "Returns", "Yields", "Raises", "Warns", "Other Parameters"}
MEMBERS = property | classmethod | staticmethod


@cache
def list_public_names() -> dict[str, list[str]]:
    """Return the public names by module, `robsim` first."""
    modules = [name for name in dir(rs) if isinstance(getattr(rs, name), ModuleType)]
    own = [name for name in dir(rs) if name not in modules]
    return {"robsim": own} | {name: list_module_names(getattr(rs, name)) for name in modules}


def list_module_names(module: ModuleType) -> list[str]:
    """Return the public names of a module, without modules and without names for its own use."""
    names = getattr(module, "__all__", None) or [n for n in dir(module) if not n.startswith("_")]
    public = [name for name in names if not isinstance(getattr(module, name), ModuleType)]
    return [name for name in public if is_documented(getattr(module, name))]


def is_documented(value: Any) -> bool:
    """Return whether a value is a class or a function of RobSim."""
    own = str(getattr(value, "__module__", "")).startswith("robsim")
    return own and (inspect.isclass(value) or callable(value))


def write_index(names: dict[str, list[str]]) -> str:
    """Return the page that lists all modules with their names."""
    lines = [
        "# Reference",
        "",
        "The public names of RobSim by module. `help(rs)` prints the modules, and `help(rs.IBVS)`",
        "prints the full entry of a name. [commands.md](commands.md) describes the command line,",
        "[kinds/](kinds/index.md) the tables of a scenario file. `docs/build.py` writes this page.",
        "",
        "| module | content | names |",
        "| --- | --- | --- |",
    ]
    for module, members in names.items():
        listed = ", ".join(f"`{name}`" for name in members)
        link = f"[`{title_of(module)}`](reference/{module}.md)"
        lines.append(f"| {link} | {summarise_module(module)} | {listed} |")
    return "\n".join(lines) + "\n"


def summarise_module(module: str) -> str:
    """Return one line about a module."""
    return "The words of an experiment." if module == "robsim" else summarise(module)


def tabulate_names(module: str, names: list[str]) -> list[str]:
    """Return a table of the names of a module, each with a link to its entry and one line."""
    rows = [f"| [`{name}`](#{name.lower()}) | {summarise(module, name)} |" for name in names]
    return ["| name | |", "| --- | --- |", *rows]


def title_of(module: str) -> str:
    """Return a module as users write it."""
    return "robsim" if module == "robsim" else f"robsim.{module}"


def find_value(module: str, name: str = "") -> Any:
    """Return a module of RobSim, or the value of a name of it."""
    found = rs if module == "robsim" else getattr(rs, module)
    return getattr(found, name) if name else found


def summarise(module: str, name: str = "") -> str:
    """Return the first paragraph of a docstring as one line of a table."""
    text = inspect.getdoc(find_value(module, name)) or ""
    return " ".join(text.split("\n\n", 1)[0].split()).replace("|", "\\|")


def write_module(module: str, names: dict[str, list[str]]) -> str:
    """Return the page of a module: an entry, or a link to the module that has it, for each name."""
    about = inspect.getdoc(find_value(module)) or ""
    lines = [f"# `{title_of(module)}`", ""]
    lines += ["The words of an experiment."] if module == "robsim" else [render_doc(about)]
    lines += ["", *tabulate_names(module, names[module])]
    for name in names[module]:
        first = next(m for m, members in names.items() if name in members)
        see = [f"## `{name}`", "", f"See [`{title_of(first)}.{name}`]({first}.md#{name.lower()})."]
        same = find_value(first, name) is find_value(module, name) and first != module
        lines += ["", *(see if same else write_entry(find_value(module, name), name))]
    return "\n".join(lines).rstrip() + "\n"


def write_entry(value: Any, name: str) -> Iterator[str]:
    """Yield the lines about a public class or function."""
    yield f"## `{name}`"
    yield from ("", "```text", format_signature(value, name), "```", "")
    yield render_doc(inspect.getdoc(value) or "")
    if inspect.isclass(value):
        for base, module in list_public_bases(value).items():
            yield from ("", f"Has the members of [`{base}`]({module}.md#{base.lower()}), too.")
        for member, found in list_members(value):
            kind = found.fget if isinstance(found, property) else found
            yield from ("", f"### `{name}.{member}`", "")
            if not isinstance(found, property) and type(found).__name__ != "cached_property":
                function = getattr(found, "__func__", found)
                yield from ("```text", format_signature(function, member), "```", "")
            yield render_doc(inspect.getdoc(getattr(kind, "__func__", kind)) or "")


def list_public_bases(kind: type[Any]) -> dict[str, str]:
    """Return the public base classes of a class, each with the module that has its entry."""
    modules = {n: m for m, names in reversed(list_public_names().items()) for n in names}
    names = [base.__name__ for base in kind.__mro__[1:] if any(n[0] != "_" for n in vars(base))]
    return {name: modules[name] for name in names if name in modules}


def list_members(kind: type[Any]) -> Iterator[tuple[str, Any]]:
    """Yield the public methods and properties of a class and of its bases without an entry."""
    found: dict[str, Any] = {}
    public = set(list_public_bases(kind))
    for owner in reversed(kind.__mro__):
        own = owner.__module__.startswith("robsim") and owner.__module__ != "robsim.base.value"
        if own and owner.__name__ not in public:
            found |= {n: v for n, v in vars(owner).items() if not n.startswith("_")}
    for name, value in found.items():
        cached = type(value).__name__ == "cached_property"
        if cached or isinstance(value, MEMBERS) or inspect.isfunction(value):
            yield name, value


def format_signature(value: Any, name: str) -> str:
    """Return a signature as text, over several lines if it is long."""
    signature = find_signature(value)
    if signature is None:
        return name
    plain = [p.replace(annotation=shorten(p.annotation)) for p in signature.parameters.values()]
    result = shorten(signature.return_annotation)
    text = f"{name}{inspect.Signature(plain, return_annotation=result)}"
    if len(text) <= 96:
        return text
    lines = [f"    {parameter}," for parameter in plain]
    keyword_only = [parameter.kind is parameter.KEYWORD_ONLY for parameter in plain]
    if True in keyword_only and not any(p.kind is p.VAR_POSITIONAL for p in plain):
        lines.insert(keyword_only.index(True), "    *,")
    end = ")" if result is inspect.Signature.empty else f") -> {result}"
    return "\n".join([f"{name}(", *lines, end])


def find_signature(value: Any) -> inspect.Signature | None:
    """Return the signature of a class or function; None if it has none, as an enumeration."""
    if inspect.isclass(value) and issubclass(value, Enum):
        return None
    try:
        return inspect.signature(value)
    except (TypeError, ValueError):
        return None


def shorten(annotation: Any) -> Any:
    """Return an annotation as text, without the modules of its classes."""
    if annotation is inspect.Parameter.empty:
        return annotation
    hint = getattr(annotation, "__forward_arg__", annotation)
    return TypeText(format_type(TypeText(hint) if isinstance(hint, str) else hint))


def render_doc(text: str) -> str:
    """Return a docstring in the form of numpydoc as Markdown."""
    head, *rest = SECTION.split(text)
    parts = [render_prose(head)]
    for title, body in zip(rest[::2], rest[1::2], strict=True):
        parts += [f"**{title}**", render_section(title, body)]
    return "\n\n".join(part for part in parts if part.strip())


def render_section(title: str, body: str) -> str:
    """Return a section of a docstring: a list of names, or prose."""
    if title not in LISTS:
        return render_prose(body)
    items: list[str] = []
    examples = ""
    if ">>>" in body:  # the first example stands behind the list
        body, examples = re.split(r"\n(?=>>> )", body, maxsplit=1)
    for line in body.rstrip().split("\n"):
        if line and not line.startswith(" "):
            name, _, kind = line.partition(" : ")
            items.append(f"- `{name}`" + (f" : {kind}" if kind else ""))
        elif line.strip() and items:  # a type goes on with an indent of two, the meaning has four
            new = line.startswith("    ") and "\n" not in items[-1]
            items[-1] += ("  \n  " if new else " ") + line.strip()
    text = "\n".join(items)
    return text + (f"\n\n{render_prose(examples)}" if examples else "")


def render_prose(text: str) -> str:
    """Return prose with its examples in fences."""
    out: list[str] = []
    inside = False
    for line in dedent(text).strip("\n").split("\n"):
        if line.startswith(">>> ") and not inside:
            out += ["```pycon"]
            inside = True
        if inside and not line.strip():
            out += ["```"]
            inside = False
        out.append(line)
    return "\n".join(out + ["```"] * inside).strip()


def write_commands() -> str:
    """Return the page of the command line: every command with its arguments and options."""
    lines = ["# Commands", "", "The commands of `robsim`. `docs/build.py` writes this page."]
    for name, command in cli.commands.items():
        context = click.Context(command, info_name=f"robsim {name}")
        usage = command.get_usage(context).removeprefix("Usage: ")
        lines += ["", f"## `robsim {name}`", "", "```text", usage, "```", ""]
        lines += [inspect.cleandoc(command.help or "").replace("\b\n", ""), ""]
        lines += list(write_options(command, context))
    return "\n".join(lines).rstrip() + "\n"


def write_options(command: click.Command, context: click.Context) -> Iterator[str]:
    """Yield the table of the options of a command."""
    records = [each.get_help_record(context) for each in command.get_params(context)]
    yield from ("| option | |", "| --- | --- |")
    for record in filter(None, records):
        option, text = (re.sub(r"\s+", " ", part).replace("|", "\\|") for part in record)
        yield f"| `{option}` | {text} |"


def write_pages() -> dict[str, Callable[[], str]]:
    """Return the functions that write the reference pages, by file."""
    names = list_public_names()
    pages: dict[str, Callable[[], str]] = {
        "reference.md": lambda: write_index(names),
        "commands.md": write_commands,
    }
    return pages | {f"reference/{m}.md": partial(write_module, m, names) for m in names}
