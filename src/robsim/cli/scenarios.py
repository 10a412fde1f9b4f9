"""Loading of scenarios for commands."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from robsim.run.experiment import Experiment


def load_with_changes(file: Path, changes: tuple[str, ...]) -> Experiment:
    """Return the experiment in a scenario file, with KEY=VALUE changes."""
    from robsim.run.experiment import load_scenario

    return load_scenario(file, set=list(changes))
