"""The function `simulate`, the short form of an experiment that runs at once."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from robsim.engine.recorder import Record
from robsim.engine.workers import Progress
from robsim.run.experiment import EXACT, PERFECT, Experiment
from robsim.run.run_checks import check_instance, check_starts, check_task
from robsim.servo.safety.safety import Safety
from robsim.servo.tasks.task import Task
from robsim.world.actuation import Actuation
from robsim.world.scene import Scene
from robsim.world.sensing import Sensing

if TYPE_CHECKING:
    import xarray as xr


def simulate(
    scene: Scene,
    task: Task,
    q0: Any = None,
    *,
    dt: float = 0.04,
    duration: float = 10.0,
    seed: int = 0,
    sensing: Sensing | None = None,
    actuation: Actuation | None = None,
    safety: Safety | None = None,
    endings: Any = (),
    hold: bool = False,
    record: Record = "all",
    first_run: int = 0,
    threads: int | None = None,
    chunk: int = 256,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Close the loop from q0 and return what happened, as an xarray.Dataset.

    q0          start (nq,), or a batch of them (B, nq); or {robot: q}; None is home
    dt          control period in seconds: a command is held for it, and the motion is exact
    duration    seconds, rounded up to whole periods
    seed        of all that is random, with the number of the run and the step
    sensing     what is wrong with the images (`Sensing`: noise, latency, ...); None for nothing
    actuation   what is wrong with the joints (`Actuation`: lag, limits, ...); None for nothing
    safety      limits that every command is kept within (`Safety`); None for none
    endings     conditions on which a run ends (`Region`, `TooClose`, or an `Ending` of your own)
    hold        go on to the end of the duration, also after convergence: to follow what moves
    record      "all", every n-th step, or "summary": the end of each run
    first_run   number of the first run, to repeat one row of a batch alone with its noise
    threads     how many; None for one per processor. The result is the same for any number
    chunk       how many runs go in lockstep at most; the result is the same for any number
    progress    called now and then with the share that is done, 0 to 1

    It is `Experiment(scene, task, q0, ...).run()` in one call. After its end a run is NaN.

    InputError before anything runs; Interrupted after Ctrl-C.

    >>> import robsim as rs
    >>> scenario = rs.load_scenario(rs.examples.path("visp_tutorial"))
    >>> run = simulate(scenario.scene, scenario.task, scenario.start, duration=25)
    >>> rs.Outcome(int(run.outcome)).name, round(float(run.error_norm[149]), 4)
    ('CONVERGED', 0.023)
    """
    experiment = Experiment(
        check_instance(scene, Scene, "scene"),
        check_task(task),
        None if q0 is None else check_starts(scene, q0, "q0"),
        sensing=PERFECT if sensing is None else sensing,
        actuation=EXACT if actuation is None else actuation,
        safety=safety,
        endings=endings,
        dt=dt,
        duration=duration,
        seed=seed,
        hold=hold,
        record=record,
        first_run=first_run,
    )
    run: xr.Dataset = experiment.run(progress, threads=threads, chunk=chunk)
    return run
