"""The words of the package: names that mean one thing, sentences that a stranger understands.

A clause with "what", "that of", "where" or "whose" in place of a noun, and programs that say or
know, make a sentence hard to read. They are rare in other scientific packages, and so they are
here: each of the five rates is bounded, per 1,000 words. Names are counted, too.
"""

import ast
import inspect
import io
import re
import tokenize
from collections import defaultdict
from functools import cache
from pathlib import Path

import pytest
from front_door import public_objects

import robsim as rs

PACKAGE = Path(rs.__file__).parent
ROOT = Path(__file__).parents[2]
RATES = {
    "what": r"\b(?:of|with|from|to|by|and|on|in|,|;|:|that|says|return|returns|see|know|knows"
    r"|tells|than|is|are|for) what\b|^what\b"
    r"|\bwhat (?:is|are|was|were|may|it|there|a|an|the|each|they|no|has|does)\b",
    "that of": r"\b(?:that|those) (?:of|in|from|at|by|with|which|who|what)\b",
    "says": r"\b(?:says?|said|tells?|told|knows?|wish(?:es|ed)?|asks?|asked)\b",
    "where": r"\bwhere (?:it|there|they|that|none|no|some|all|each|one|a|the|both|nothing|any|its"
    r"|these|this|several|neither)\b",
    "of which": r"\b(?:of|in|from|by|with|at|to|on|for) (?:which|whom)\b|\bwhose\b",
}
PARTICIPLE = r"(\w+_)?\w+(ed|en|ing|own|aid|eld|old|oken|ought)"
GENERATED = {"commands.md", "reference.md"}
GENERATED_FOLDERS = {"kinds", "reference"}


@cache
def trees():
    """The parsed files of the package by path below it."""
    files = sorted(PACKAGE.rglob("*.py"))
    return {f.relative_to(PACKAGE): ast.parse(f.read_text(encoding="utf-8")) for f in files}


def code_texts():
    """The docstrings without their examples, and the comments, of the package."""
    documented = ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef | ast.Module
    for path, tree in trees().items():
        found = (ast.get_docstring(n) for n in ast.walk(tree) if isinstance(n, documented))
        yield from (re.sub(r">>>.*?(\n\n|$)", "", text, flags=re.S) for text in found if text)
        lines = io.StringIO((PACKAGE / path).read_text(encoding="utf-8")).readline
        tokens = tokenize.generate_tokens(lines)
        yield from (token.string for token in tokens if token.type == tokenize.COMMENT)


def page_texts():
    """The pages of the documentation without their code."""
    pages = [f for f in (ROOT / "docs").rglob("*.md") if f.name not in GENERATED]
    written = [page for page in pages if page.parent.name not in GENERATED_FOLDERS]
    for page in [*written, ROOT / "README.md", ROOT / "CHANGELOG.md"]:
        yield re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.S)


@pytest.mark.parametrize("texts", [code_texts, page_texts])
@pytest.mark.full
def test_sentences_name_their_nouns(texts):
    found = list(texts())
    words = sum(len(text.split()) for text in found)
    for name, pattern in RATES.items():
        hits = sum(len(re.findall(pattern, text, re.I | re.M)) for text in found)
        assert 1000 * hits / words <= 1.0, name


def files_by(name_of):
    """The files of the package that define each name."""
    found = defaultdict(set)
    for path, tree in trees().items():
        for name in name_of(path, tree):
            found[name].add(path)
    return found


def functions(path, tree):
    return [n.name.lstrip("_") for n in tree.body if isinstance(n, ast.FunctionDef)]


def classes(path, tree):
    return [n.name.lstrip("_") for n in ast.walk(tree) if isinstance(n, ast.ClassDef)]


def test_a_function_name_means_one_thing():
    shared = {name for name, files in files_by(functions).items() if len(files) >= 3}
    names = [name for path, tree in trees().items() for name in functions(path, tree)]
    assert sum(name in shared for name in names) <= 0.03 * len(names), shared


def test_a_class_name_is_defined_once():
    names = [name for path, tree in trees().items() for name in classes(path, tree)]
    assert sorted({name for name in names if names.count(name) > 1}) == []


def test_a_file_is_a_noun_of_its_own():
    stems = files_by(lambda path, _: [] if path.name == "__init__.py" else [path.stem])
    assert len([stem for stem, files in stems.items() if len(files) > 1]) <= 20
    assert len([stem for stem in stems if re.fullmatch(PARTICIPLE, stem)]) <= 5


def imported_from(tree, modules):
    """The modules of the package that a file imports, its functions included."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module:
            full = [f"{node.module}.{alias.name}" for alias in node.names]
            yield from (name if name in modules else node.module for name in full)
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)


def test_a_short_file_has_more_than_one_user():
    names = {path: ".".join(["robsim", *path.with_suffix("").parts]) for path in trees()}
    users = defaultdict(set)
    for path, tree in trees().items():
        for module in imported_from(tree, set(names.values())):
            users[module].add(path)
    lines = {path: len((PACKAGE / path).read_text(encoding="utf-8").splitlines()) for path in names}
    short = [p for p in names if p.name != "__init__.py" and lines[p] < 40]
    assert [str(path) for path in short if len(users[names[path]]) == 1] == []


def test_the_front_door_has_few_names():
    assert len(dir(rs)) <= 75


def annotations(value):
    """The annotations of a function, or of the public fields and methods of a class."""
    if not inspect.isclass(value):
        yield from getattr(value, "__annotations__", {}).items()
        return
    for owner in value.__mro__:
        if not owner.__module__.startswith("robsim"):
            continue
        fields = vars(owner).get("__annotations__", {})
        yield from ((f"{owner.__name__}.{name}", kind) for name, kind in fields.items())
        for name, member in vars(owner).items():
            function = getattr(member, "fget", None) or getattr(member, "func", None) or member
            function = getattr(function, "__func__", function)
            if not name.startswith("_") and inspect.isfunction(function):
                own = function.__annotations__.items()
                yield from ((f"{owner.__name__}.{name}({key})", kind) for key, kind in own)


def type_text(kind):
    """The text of an annotation; of `Annotated[type, spec, meaning]` that of the type."""
    written = ast.parse(kind, mode="eval").body if isinstance(kind, str) else None
    if isinstance(written, ast.Subscript) and ast.unparse(written.value) == "Annotated":
        return ast.unparse(written.slice.elts[0])
    return str(kind)


def test_the_public_interface_has_types():
    found = {}
    for module, name, value in public_objects():
        for place, kind in annotations(value):
            text = type_text(kind)
            if re.search(r"\bAny\b", text) and not re.search(r"dtype|ClassVar", text):
                found[place if "." in place else f"{module}.{name}.{place}"] = text
    assert 0 < len(found) <= 30, found


def test_every_public_name_has_an_example():
    missing = [f"{m}.{n}" for m, n, value in public_objects() if ">>>" not in value.__doc__]
    assert missing == []


def test_no_function_differs_from_a_class_by_case_alone():
    names = {(module, name) for module, name, _ in public_objects()}
    assert len({(module, name.lower()) for module, name in names}) == len(names)


def test_the_signature_of_a_task_fits_a_screen():
    assert len(str(inspect.signature(rs.IBVS))) <= 540


def test_the_docstring_of_the_package_is_a_map_of_its_names():
    assert rs.__doc__ is not None
    listed = re.findall(r"^    (\w+)  ", rs.__doc__, re.M)
    assert sorted(listed) == sorted(dir(rs))
    assert all(re.search(rf"^    {name} +[A-Z].*\.$", rs.__doc__, re.M) for name in listed)
