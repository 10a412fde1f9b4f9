"""Count the code of the machinery of declarations: it reads, writes and finds values by name.

These are the files of `declare`, those of the text and the paths of an experiment and a study, and
every class elsewhere that declares how a value stands in a text.
"""

from __future__ import annotations

import ast
import io
import tokenize
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[1] / "src" / "robsim"
NO_CODE = {
    *(tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT),
    tokenize.ENDMARKER,
}
WHOLE = (
    *(
        "run/experiment_text.py",
        "run/brief_text.py",
        "run/experiment_overrides.py",
        "run/experiment_paths.py",
        "run/batch_numbers.py",
    ),
    "run/beliefs.py",
    *("run/start_table.py", "files/toml_layout.py", "studies/study_text.py"),
)


def machinery() -> dict[str, int]:
    """Return the lines of code of each file, and of each class elsewhere, by name."""
    trees = {path: ast.parse(path.read_text("utf-8")) for path in sorted(ROOT.rglob("*.py"))}
    bases: dict[str, set[str]] = {}
    for tree in trees.values():
        for each in classes(tree):
            bases.setdefault(each.name, set()).update(base_names(each))
    found: dict[str, int] = {}
    for path, tree in trees.items():
        name = path.relative_to(ROOT).as_posix()
        if name.startswith("declare/") or name in WHOLE:
            found[name] = len(code_lines(path))
            continue
        for each in classes(tree):
            if each.name.endswith("Table") or is_spec(each.name, bases, base_names(each)):
                first = min([each.lineno, *(line.lineno for line in each.decorator_list)])
                span = range(first, (each.end_lineno or first) + 1)
                found[f"{name}:{each.name}"] = len(code_lines(path).intersection(span))
    return found


@cache
def code_lines(path: Path) -> set[int]:
    """Return the numbers of the lines with code, without docstrings, comments and blank lines."""
    text = path.read_text("utf-8")
    documented = ast.Module | ast.ClassDef | ast.FunctionDef
    nodes = [each for each in ast.walk(ast.parse(text)) if isinstance(each, documented)]
    strings = [each.body[0] for each in nodes if ast.get_docstring(each) is not None]
    docs = {i for each in strings for i in range(each.lineno, (each.end_lineno or 0) + 1)}
    tokens = tokenize.generate_tokens(io.StringIO(text).readline)
    spans = (range(t.start[0], t.end[0] + 1) for t in tokens if t.type not in NO_CODE)
    return {i for span in spans for i in span} - docs


def classes(tree: ast.Module) -> list[ast.ClassDef]:
    """Return the classes of a module."""
    return [each for each in tree.body if isinstance(each, ast.ClassDef)]


def base_names(kind: ast.ClassDef) -> set[str]:
    """Return the names of the base classes of a class."""
    return {ast.unparse(base).rpartition(".")[2] for base in kind.bases}


def is_spec(name: str, bases: dict[str, set[str]], own: set[str]) -> bool:
    """Return whether a class with these bases derives from `Spec`."""
    seen, left = {name}, set(own)
    while left:
        one = left.pop()
        if one == "Spec":
            return True
        seen.add(one)
        left |= bases.get(one, set()) - seen
    return False


if __name__ == "__main__":
    counted = machinery()
    for name, lines in sorted(counted.items(), key=lambda each: -each[1]):
        print(f"{lines:6d}  {name}")
    print(f"{sum(counted.values()):6d}  in all")
