"""The function `simulate`, which creates an experiment and runs it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from robsim.engine.endings import Ending
from robsim.engine.recorder import Record
from robsim.engine.workers import Progress
from robsim.run.experiment import EXACT, PERFECT, Coordinates, Experiment
from robsim.run.run_checks import check_instance, check_starts, check_task
from robsim.servo.safety.safety import Safety
from robsim.servo.tasks.task import Task
from robsim.world.actuation import Actuation
from robsim.world.scene import Scene
from robsim.world.sensing import Sensing

if TYPE_CHECKING:
    from robsim.files.flat_table import RunDataset


def simulate(
    scene: Scene,
    task: Task,
    q0: Coordinates | None = None,
    *,
    dt: float = 0.04,
    duration: float = 10.0,
    seed: int = 0,
    sensing: Sensing | None = None,
    actuation: Actuation | None = None,
    safety: Safety | None = None,
    endings: Ending | Sequence[Ending] = (),
    hold: bool = False,
    record: Record = "all",
    first_run: int = 0,
    threads: int | None = None,
    chunk: int = 256,
    progress: Progress | None = None,
) -> RunDataset:
    """Simulate the closed loop of a task from q0, and return the run as an xarray.Dataset.

    The call equals `Experiment(scene, task, q0, ...).run()`. Commands are computed at every control
    period and held for it, and the motion over a period is exact. After the end of a run its
    variables are NaN.

    Parameters
    ----------
    scene : Scene
        Robots, objects and cameras, as they truly are.
    task : Task
        Control task, such as `IBVS` or `FollowJoints`.
    q0 : array_like of shape (nq,) or (B, nq), or dict, optional
        Coordinates at the start, a batch of B starts, or {robot: q}. Default: the home
        configuration.
    dt : float, default 0.04
        Control period in seconds.
    duration : float, default 10.0
        Longest duration in seconds, rounded up to whole periods.
    seed : int, default 0
        Seed of all random numbers, which also depend on the number of the run and the step.
    sensing : Sensing, optional
        Errors of the images: noise, latency and others. Default: none.
    actuation : Actuation, optional
        Errors of the joints: lag, limits and others. Default: none.
    safety : Safety, optional
        Limits within which every command is kept. Default: none.
    endings : sequence of Ending, optional
        Further conditions that end a run: `Region`, `TooClose`, or your own `Ending`.
    hold : bool, default False
        Whether a run continues after convergence until the end of the duration. Use it to track
        moving targets.
    record : {"all", "summary"} or int, default "all"
        Recorded steps: all, every n-th, or only the end of each run.
    first_run : int, default 0
        Number of the first run. Use it to repeat a single run of a batch with its noise.
    threads : int, optional
        Number of threads. Default: one for each processor. It does not change the result.
    chunk : int, default 256
        Largest number of runs that advance in lockstep. It does not change the result.
    progress : callable, optional
        Function that is called repeatedly with the finished share, from 0 to 1.

    Returns
    -------
    xarray.Dataset
        Coordinates, commands, features, errors and pixels over time, and outcome and end of each
        run.

    Raises
    ------
    InputError
        If an argument is not valid. It is raised before the simulation begins.
    Interrupted
        If the user stops the simulation. Its attribute `run` is the run so far.

    Examples
    --------
    >>> import robsim as rs
    >>> scenario = rs.load_scenario(rs.examples.path("visp_tutorial"))
    >>> run = simulate(scenario.scene, scenario.task, scenario.start, duration=25)
    >>> rs.Outcome(int(run.outcome)).name, round(float(run.error_norm[149]), 4)
    ('CONVERGED', 0.023)
    """
    experiment: Experiment[Task] = Experiment(
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
    return experiment.run(progress, threads=threads, chunk=chunk)
