"""Repeating a run from what it says about itself."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

from robsim.base.errors import ReplayWarning
from robsim.base.unit_warnings import find_user_stacklevel
from robsim.run.difference import find_difference
from robsim.run.experiment import Experiment
from robsim.run.log_commands import is_log_run, replay_log_run
from robsim.run.provenance import check_run

if TYPE_CHECKING:
    import xarray as xr


def replay(run: xr.Dataset) -> xr.Dataset:
    """Return the same run, batch, or selection of consecutive runs once more, with the same bits.

    It is `Experiment.of(run).run()`. Where it is another run than the one that was given, which
    was changed or comes from another version or machine, a ReplayWarning says the first difference.
    Of a run that was recorded (`read_bag`, `read_log`) the controller is given the recorded images
    and joints, and `qd` is what it commands; the warning says by how much the recorded commands
    differ.

    InputError: the run does not say how it was made.

    >>> from robsim.files import examples
    >>> run = Experiment.from_text(examples.path("visp_tutorial").read_text()).run(duration=0.4)
    >>> replay(run).identical(run)
    True
    """
    check_run(run)
    if is_log_run(run):
        return replay_log_run(run)
    again: xr.Dataset = Experiment.of(run).run()
    again.attrs |= {key: run.attrs[key] for key in ("scenario", "single")}
    if other := find_difference(run, again):
        text = f"the run is not the one that was given: {other}"
        warnings.warn(text, ReplayWarning, stacklevel=find_user_stacklevel())
    return again
