"""Every example in a docstring runs."""

import doctest
import importlib
import pkgutil

import numpy as np
import pytest

import robsim

MODULES = sorted(m.name for m in pkgutil.walk_packages(robsim.__path__, "robsim."))


@pytest.mark.parametrize("name", MODULES)
def test_the_examples_in_its_docstrings_run(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    module = importlib.import_module(name)
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS)
    for docstring in doctest.DocTestFinder().find(module, extraglobs={"np": np}):
        if docstring.examples:  # the runner checks every cached source, also without an example
            runner.run(docstring)
    assert runner.failures == 0
