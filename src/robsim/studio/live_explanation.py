"""The explanation of a run in progress."""

from __future__ import annotations

from contextlib import suppress

from robsim.base.errors import InputError
from robsim.page.curves_and_texts import collect_run_texts
from robsim.run.experiment import Experiment
from robsim.studio.live_run import LiveRun


def explain_live_run(experiment: Experiment, live: LiveRun, trials: bool) -> dict[str, str]:
    """Return the explanation of a run and the text of its experiment.

    If `trials`, the explanation includes changes that improve the run, found by simulation.
    """
    collected = collect_run_texts(live.segment.run(), live.segment, trials)
    if live.start_time:
        heading = f"After the last change at {live.start_time:.2f} s (times count from there):\n"
        collected["explanation"] = heading + collected["explanation"]
    with suppress(InputError):
        collected["experiment"] = experiment.text
    return collected
