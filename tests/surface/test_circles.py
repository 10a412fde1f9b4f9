"""No circle of imports joins more than two files, wherever the imports stand."""

import ast
from pathlib import Path

import pytest

import robsim

PACKAGE = Path(robsim.__file__).parent
FILES = {
    ".".join(["robsim", *path.relative_to(PACKAGE).with_suffix("").parts]).removesuffix(
        ".__init__"
    ): path
    for path in sorted(PACKAGE.rglob("*.py"))
}


def names(node):
    """The modules that a statement or a call imports: at the top, in a function, for a type."""
    if isinstance(node, ast.Import):
        yield from (alias.name for alias in node.names)
    elif isinstance(node, ast.ImportFrom):
        for alias in node.names:
            full = f"{node.module}.{alias.name}"
            yield full if full in FILES else node.module
    elif isinstance(node, ast.Call) and ast.unparse(node.func).split(".")[-1] in (
        "import_module",
        "__import__",
    ):
        yield from (each.value for each in node.args if isinstance(each, ast.Constant))


def imports():
    """The files of RobSim that each file imports."""
    found = {}
    for module, path in FILES.items():
        tree = ast.parse(path.read_text(encoding="utf-8"))
        wanted = {name for node in ast.walk(tree) for name in names(node)}
        found[module] = sorted((wanted & FILES.keys()) - {module})
    return found


def circles(graph):
    """The sets of nodes that lead to each other (Tarjan 1972)."""
    low, number, stack, found = {}, {}, [], []

    def visit(node):
        low[node] = number[node] = len(number)
        stack.append(node)
        for other in graph[node]:
            if other not in number:
                visit(other)
            if other in stack:
                low[node] = min(low[node], low[other])
        if low[node] == number[node]:
            first = stack.index(node)
            found.append(sorted(stack[first:]))
            del stack[first:]

    for node in graph:
        if node not in number:
            visit(node)
    return [each for each in found if len(each) > 1]


def test_a_circle_is_found():
    assert circles({"a": ["b"], "b": ["c"], "c": ["b"], "d": ["a"]}) == [["b", "c"]]


@pytest.mark.full
def test_no_circle_of_imports_joins_more_than_two_files():
    graph = imports()
    assert len(graph) > 600 and "robsim.declare" in graph["robsim.features.feature"]
    assert [each for each in circles(graph) if len(each) > 2] == []
