"""The report of a run on the command line."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

from robsim.cli.tell import tell

if TYPE_CHECKING:
    import xarray as xr

    from robsim.engine.outcome import Outcome
    from robsim.run.mission_run import MissionRun
    from robsim.servo.safety.safety import Safety

STOPPING = ("margin", "fence", "watchdog")  # parts of a safety that may bring a robot to a stand


def report(result: xr.Dataset, folder: Path, safety: Safety | None = None) -> None:
    """Print how a run ended, or how many runs of a batch ended in each way.

    What `safety` the run had is told where it may be why the robot stands still.
    """
    from robsim.engine.outcome import Outcome
    from robsim.run.ends import elsewhere

    if "run" in result.dims:
        for outcome in Outcome:
            if count := int((result.outcome == outcome).sum()):
                tell(f"{count:7} {outcome.name}")
        if astray := int(elsewhere(result).sum()):
            tell(f"{astray:7} converged more than 1 cm or 1 degree from the pose of the goal")
    else:
        tell(f"outcome      {_message(Outcome(int(result.outcome)), safety)}")
        if int(result.outcome) != Outcome.CONVERGED and result.sizes["mark"]:
            tell(f"why          robsim explain {folder}")
        tell(f"time         {float(result.end_time):.2f} s")
        away = float(result.pixel_error)
        if not math.isnan(away):  # a goal given as numbers has no image
            tell(f"final error  {away:.3g} px")
        _print_pose(result, folder)
        tell(f"path length  {100 * float(result.path_length):.2f} cm")
    tell(f"results      {folder}")


def _message(outcome: Outcome, safety: Safety | None) -> str:
    """Return what an outcome means, and what may hold a robot that stands still."""
    from robsim.engine.outcome import Outcome

    own = [part for part in STOPPING if getattr(safety, part, None) is not None]
    if outcome is not Outcome.LOCAL_MINIMUM or not own:
        return outcome.message
    from robsim.analysis.explanation.safeties import SAFETY
    from robsim.analysis.explanation.wording import listed

    held = f"{listed([SAFETY[part][0] for part in own], 'or')} may hold the robot"
    return f"{outcome.words}: no motion is commanded although the error remains; {held}"


def report_mission(result: MissionRun, folder: Path) -> None:
    """Print when each phase of a mission began, and how it ended."""
    tell(str(result))
    tell(f"outcome      {'all phases as expected' if result.succeeded else 'not completed'}")
    tell(f"time         {result.legs[-1].end:.2f} s")
    tell(f"results      {folder}")


def _print_pose(result: xr.Dataset, folder: Path) -> None:
    """Print how far from its goal a run ended in space, with a note if that is notable."""
    from robsim.analysis.explanation.wording import away
    from robsim.run.ends import elsewhere

    metres, radians = float(result.distance_to_goal), float(result.angle_to_goal)
    if math.isnan(metres):  # the goal is not a pose
        return
    who = result.goal_pose.attrs["frame"]
    tell(f"final pose   {who} {away(metres, radians)} from its goal")
    if elsewhere(result):
        tell(f"note         it converged at another pose: robsim explain {folder}")
