"""What tests of bad input share."""

import sys

import pytest

from robsim import cli


@pytest.fixture
def called(monkeypatch, capsys):
    """`robsim ARGUMENTS` in this process: (status, out, err)."""

    def call(*arguments):
        monkeypatch.setattr(sys, "argv", ["robsim", *map(str, arguments)])
        status = 0
        try:
            cli.main()
        except SystemExit as stop:
            status = stop.code or 0
        out, err = capsys.readouterr()
        assert "Traceback" not in out + err
        return status, out, err

    return call
