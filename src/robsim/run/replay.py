"""The function `replay`, which repeats a run from its stored experiment."""

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

STORED = ("scenario", "stored_data", "single")  # attributes that the repeated run shares


def replay(run: xr.Dataset) -> xr.Dataset:
    """Simulate a run, a batch or consecutive runs of a batch once more.

    The call equals `Experiment.of(run).run()`. On the same machine and with the same versions the
    result has the same bits. For a run from a log (`read_bag`, `read_log`), the controller is
    evaluated for the recorded images and joints, and `qd` holds its commands.

    Parameters
    ----------
    run : xarray.Dataset
        Run that `simulate`, `Experiment.run` or `open_run` returned.

    Returns
    -------
    xarray.Dataset
        The repeated run.

    Raises
    ------
    InputError
        If the run stores no experiment.

    Warns
    -----
    ReplayWarning
        If the result differs from `run`, which was changed or comes from another version or
        machine. The message gives the first difference, or the largest deviation of recorded
        commands.

    Examples
    --------
    >>> from robsim.files import examples
    >>> run = Experiment.from_text(examples.path("visp_tutorial").read_text()).run(duration=0.4)
    >>> replay(run).identical(run)
    True
    """
    check_run(run)
    if is_log_run(run):
        return replay_log_run(run)
    again = Experiment.of(run).run()
    again.attrs |= {key: run.attrs[key] for key in STORED if key in run.attrs}
    if differences := find_difference(run, again):
        text = f"the repeated run differs: {differences}"
        warnings.warn(text, ReplayWarning, stacklevel=find_user_stacklevel())
    return again
