"""The experiment: all that is needed for a run, as one value."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from robsim.base import interrupt
from robsim.base.arrays import flag
from robsim.base.errors import FileError, GoalError, InputError, Interrupted
from robsim.base.output import refused
from robsim.base.values import unchanging
from robsim.engine.instant import Instant, instants
from robsim.engine.loop import Loop
from robsim.engine.start_view import check_view
from robsim.engine.workers import Progress, advance
from robsim.files.changes import Changes
from robsim.files.toml import read_text
from robsim.run import overview
from robsim.run.changed import names_files
from robsim.run.checkpoint import Keeper, identity
from robsim.run.checks import whole_periods
from robsim.run.mission_run import MissionRun
from robsim.run.origin import attributes_of, made_with, one_run
from robsim.run.staged import Staged
from robsim.run.written import Written

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True, eq=False, repr=False)
class Experiment(Written):
    """A scene, a task, a start, imperfections and a duration, as one frozen value.

    scene, task  what there is, and what is to be done: a task, or a `Mission`
    start        (nq,), a batch of starts (B, nq), or {robot: q}; None: home
    sensing      what is wrong with the images
    actuation    what is wrong with the joints
    safety       limits that every command is kept within (`Safety`); None: none
    endings      conditions on which a run ends (`Region`, `TooClose`, or of a kind of your own)
    dt           control period in seconds: a command is held for it
    duration     seconds, rounded up to whole periods
    seed         of all that is random
    hold         go on to the end of the duration, also after convergence
    record       "all", every n-th step, or "summary": the end of each run
    first_run    number of the first run; its noise comes from this and the seed
    title        what it shows, in a line

    Two experiments are equal where all these are. `text` is TOML that says it, `hash` stands for
    it, `at` and `with_` give changed copies, `run` runs it.

    >>> from robsim import examples
    >>> experiment = load_scenario(examples.path("visp_tutorial"))
    >>> experiment.at("task.gain", 2.0).task.gain, experiment.with_(dt=0.02).dt
    (2.0, 0.02)
    """

    def __repr__(self) -> str:
        """Return a few lines: the scene, the task, and the settings."""
        return overview.text(self)

    def _repr_html_(self) -> str:
        """Return a table for notebooks."""
        return overview.table(self)

    @classmethod
    def of(cls, run: xr.Dataset | MissionRun) -> Experiment:
        """Return the experiment that a run, a batch or consecutive runs of it were made of.

        InputError: the run does not say.

        >>> from robsim import examples
        >>> experiment = load_scenario(examples.path("visp_tutorial")).with_(duration=0.4)
        >>> Experiment.of(experiment.run()) == experiment
        True
        """
        attributes = attributes_of(run)
        text = attributes.get("scenario", "")
        if not text:
            reason = run.attrs.get("no_scenario", "it has no attrs['scenario']")
            raise InputError(f"this run cannot be repeated from its own text: {reason}")
        made = cls.from_text(text, "scenario of the run")
        if isinstance(made.task, Staged):
            return made
        whole_run = cast(Any, run)
        same = made._as(made_with(whole_run))
        varied = {name: whole_run[name].values for name in attributes.get("varied", "").split()}
        if not varied:
            return same
        return same.vary(varied) if "run" in whole_run.dims else same.at(varied)

    def check(self, *, view: bool = True) -> None:
        """Check task, start and settings as a run would, without running.

        With `view`, a start that does not see its target is an error; as a run it ends at once.

        GoalError, FileError: a run would be refused.
        """
        with self._named():
            if isinstance(self.task, Staged):
                with self.keyed("task"):
                    self.task.checked(self, view=view)
                return
            loop = self._loop_from_start()
            if view:
                check_view(loop)

    def run(
        self,
        progress: Progress | None = None,
        *,
        threads: int | None = None,
        chunk: int = 256,
        checkpoint: str | os.PathLike[str] | Keeper | None = None,
        resume: bool = False,
        **changes: Any,
    ) -> Any:
        """Simulate, and return the run: an xarray.Dataset, or a `MissionRun` of a mission.

        `changes` are those of `with_`, for this run.

        `threads`, `chunk` and `progress` are as in `simulate`. The run keeps the text of the
        experiment, so that `replay` can repeat it.

        `checkpoint` is a file that is written every ten seconds or so, and when a stop comes (see
        `Interrupted`). With `resume` the run goes on from there, on this machine and with these
        versions, and has the same bits as if it had not been stopped. Delete it when the run is
        saved. FileError: it does not serve. FileWarning: it cannot be written.

        >>> from robsim import examples
        >>> experiment = load_scenario(examples.path("visp_tutorial"))
        >>> run = experiment.run(checkpoint="run.checkpoint")  # once more with resume=True
        """
        if changes:
            one = self.with_(**changes)
            how: dict[str, Any] = {"threads": threads, "chunk": chunk}
            return one.run(progress, checkpoint=checkpoint, resume=resume, **how)
        keeper = self._keeper(checkpoint, resume)
        how = {"threads": threads, "chunk": chunk, "progress": progress}
        with interrupt.held(begun=False) as stops, self._named():
            if isinstance(self.task, Staged):
                with self.keyed("task"):
                    result = self.task.simulated(self, checkpoint=keeper, **how)
                finished = True
            else:
                loop = self.loop()
                with self.keyed("task"):
                    finished = advance(loop, checkpoints=keeper, **how)
                result = self.dataset(loop)
        if stops or not finished:
            raise Interrupted("stopped by the user; what was simulated so far is in .run", result)
        return result

    def _keeper(self, checkpoint: Any, resume: bool) -> Keeper | None:
        """Return what keeps checkpoints, if any are wanted; that of a mission serves its phases."""
        if isinstance(checkpoint, Keeper):
            return checkpoint
        again = flag(resume, "resume")
        if checkpoint is None:
            if again:
                raise InputError("resume: from which file? give checkpoint=path")
            return None
        with self._named():
            identity(self)
        with refused(checkpoint, "keep"):
            return Keeper(checkpoint, self, again)

    def steps(self) -> Iterator[Instant]:
        """Yield the instants of a single run one by one, so that you may watch, or stop.

        The last one is that at which the run ends. InputError: a mission, or several starts.

        >>> from robsim import examples
        >>> experiment = load_scenario(examples.path("visp_tutorial"))
        >>> now = next(experiment.steps())
        >>> now.time, now.q.shape, now.outcome.name
        (0.0, (7,), 'RUNNING')
        """
        if isinstance(self.task, Staged):
            raise InputError("steps: a mission has several runs; take the experiment of a phase")
        if np.ndim(self.start) > 1 or self.varied:
            raise InputError(
                "steps: one start is needed, and there are several runs: take of_run(i)"
            )
        with self._named():
            loop = self._loop_from_start()
        return instants(loop)

    def _loop_from_start(self) -> Loop:
        """Return the loop without a record; InputError if no start lets the task be done."""
        loop = self.with_(record="summary").loop()
        with self.keyed("task"):
            loop.controller.check_start(loop.q0)
        return loop

    def dataset(self, loop: Loop) -> xr.Dataset:
        """Return what a loop of this experiment has recorded."""
        from robsim.run.result import dataset

        parts = self.task, self.sensing, self.actuation, self.endings
        if not (self.scene.tree.compiled and all(map(unchanging, parts))):
            _ = self.origin  # written now: later a user's object may be another
        return dataset(loop, self, lambda: self.origin)

    @cached_property
    def origin(self) -> dict[str, str]:
        """What a run says of its experiment: the text, or why there is none."""
        one = one_run(self)
        try:
            exact = names_files(one.__dict__.get("tables"))  # the files may change
            return {"scenario": one.to_toml(complete=True) if exact else one.text}
        except InputError as reason:
            return {"scenario": "", "no_scenario": str(reason)}

    def _as(self, fields: Mapping[str, Any]) -> Experiment:
        """Return the experiment with other fields where they are not the same."""
        home = self.scene.home if self.start is None else self.start
        steps = whole_periods(self.dt, self.duration)
        same = {
            "start": np.array_equal(home, fields["start"]),
            "duration": steps == whole_periods(fields["dt"], fields["duration"]),
        }
        other = {
            name: value
            for name, value in fields.items()
            if not same.get(name, value == getattr(self, name))
        }
        return self.with_(**other) if other else self

    @contextmanager
    def _named(self) -> Iterator[None]:
        """Put the name of the file, if any, in front of errors from inside."""
        if not self.source:
            yield
            return
        try:
            yield
        except InputError as error:
            kind = GoalError if isinstance(error, GoalError) else FileError
            raise kind(f"{self.source}: {error}") from None


def load_scenario(path: str | os.PathLike[str], set: Changes = ()) -> Experiment:
    """Return the experiment of a scenario file, with changes such as ["task.gain=2"].

    FileError: whatever is wrong, with the key and what would be valid.

    >>> from robsim import examples
    >>> load_scenario(examples.path("visp_tutorial"), ["task.gain=2", "run.dt=20 ms"]).dt
    0.02
    """
    return Experiment.from_text(read_text(path), str(path), set)
