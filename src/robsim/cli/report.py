"""Report of a run on the command line."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

from robsim.cli.console import print_text

if TYPE_CHECKING:
    import xarray as xr

    from robsim.engine.outcome import Outcome
    from robsim.run.mission_run import MissionRun
    from robsim.servo.safety.safety import Safety

STOPPING = ("margin", "fence", "watchdog")  # safety functions that can stop a robot


def print_run_report(result: xr.Dataset, folder: Path, safety: Safety | None = None) -> None:
    """Print the outcome of a run, or the number of runs of a batch with each outcome.

    `safety` is the safety of the run, which may have stopped the robot.
    """
    from robsim.engine.outcome import Outcome
    from robsim.run.active_constraints import name_holding_constraints
    from robsim.run.end_variables import find_converged_elsewhere

    if "run" in result.dims:
        for outcome in Outcome:
            if count := int((result.outcome == outcome).sum()):
                print_text(f"{count:7} {outcome.name}")
        if astray := int(find_converged_elsewhere(result).sum()):
            print_text(f"{astray:7} converged more than 1 cm or 1 degree from the pose of the goal")
    else:
        print_text(f"outcome      {_format_outcome_message(Outcome(int(result.outcome)), safety)}")
        if int(result.outcome) != Outcome.CONVERGED and (held := name_holding_constraints(result)):
            print_text(f"held by      {', '.join(held)}")
        if int(result.outcome) != Outcome.CONVERGED and result.sizes["mark"]:
            print_text(f"why          robsim explain {folder}")
        print_text(f"time         {float(result.end_time):.2f} s")
        away = float(result.pixel_error)
        if not math.isnan(away):  # a goal given as numbers has no image
            print_text(f"final error  {away:.3g} px")
        _print_final_pose(result, folder)
        print_text(f"path length  {100 * float(result.path_length):.2f} cm")
        _print_torques(result)
    print_text(f"results      {folder}")


def _format_outcome_message(outcome: Outcome, safety: Safety | None) -> str:
    """Return the message of an outcome, with the safety functions that may hold the robot."""
    from robsim.engine.outcome import Outcome

    own = [part for part in STOPPING if getattr(safety, part, None) is not None]
    if outcome is not Outcome.LOCAL_MINIMUM or not own:
        return outcome.message
    from robsim.analysis.explanation.safety_limits import SAFETY_LIMITS
    from robsim.analysis.explanation.text_format import format_list

    may_hold = f"{format_list([SAFETY_LIMITS[part][0] for part in own], 'or')} may hold the robot"
    return f"{outcome.words}: no motion is commanded although the error remains; {may_hold}"


def print_mission_report(result: MissionRun, folder: Path) -> None:
    """Print the start and the outcome of each phase of a mission."""
    print_text(str(result))
    print_text(f"outcome      {'all phases as expected' if result.succeeded else 'not completed'}")
    print_text(f"time         {result.legs[-1].end:.2f} s")
    print_text(f"results      {folder}")


def _print_torques(result: xr.Dataset) -> None:
    """Print the joint whose torque comes nearest to its limit, and the joints that are limited."""
    if "torque" not in result or "time" not in result.dims:
        return
    driven = result.isel(time=slice(1, None))  # the first torques hold the robot at rest
    shares = (abs(driven["torque"]) / driven["torque_limit"]).max("time").fillna(0.0)
    names = result["velocity"].values.tolist()
    if (most := float(shares.max())) > 0.0:
        nearest = names[int(shares.argmax("velocity"))]
        print_text(f"torque       at most {100 * most:.0f} % of the limit, at {nearest}")
    limited = zip(names, driven["saturation"].mean("time").values.tolist(), strict=True)
    if parts := [f"{name} {100 * share:.2g} %" for name, share in limited if share > 0.0]:
        print_text(f"limited      {', '.join(parts)} of the time")


def _print_final_pose(result: xr.Dataset, folder: Path) -> None:
    """Print the distance of the final pose from the goal, with a note if it is large."""
    from robsim.analysis.explanation.text_format import format_offset
    from robsim.run.end_variables import UPSIDE_DOWN, find_converged_elsewhere

    metres, radians = float(result.distance_to_goal), float(result.angle_to_goal)
    if math.isnan(metres):  # the goal is not a pose
        return
    frame = result.goal_pose.attrs["frame"]
    print_text(f"final pose   {frame} {format_offset(metres, radians)} from its goal")
    if find_converged_elsewhere(result):
        turned = radians > UPSIDE_DOWN
        where = "upside down, turned by half a turn" if turned else "at another pose"
        print_text(f"note         it converged {where}: robsim explain {folder}")
