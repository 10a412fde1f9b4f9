"""An experiment as text: tables that say it, and copies in which names have other values."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np

from robsim.base.arrays import whole
from robsim.base.errors import FileError, InputError, said
from robsim.declare.controls import Control
from robsim.declare.spec import Live
from robsim.files.changes import Changes
from robsim.files.toml import Tables, parse, write
from robsim.run.brief import brief_text
from robsim.run.by_hand import experiment_controls
from robsim.run.changed import changed, has_objects
from robsim.run.setup import Setup
from robsim.run.text import (
    SCENE,
    read_experiment,
    text_of,
    write_experiment,
)
from robsim.run.varied import checked

# the field of which a table of the text is a part, where it is not a setting
GROUPS = {**dict.fromkeys(SCENE, "scene"), "task": "task", "start": "start", "belief": "belief"}


@dataclass(frozen=True, eq=False)
class Written(Setup):
    """The fields of an `Experiment`, which a text can say."""

    @classmethod
    def from_text(cls, text: str, source: str = "<text>", set: Changes = ()) -> Self:
        """Return the experiment of a TOML text.

        `set` are changes such as {"task.gain": "2"} or ["task.gain=2"].

        FileError: whatever is wrong, with the key and what would be valid.

        >>> from robsim import Experiment
        >>> Experiment.from_text('''
        ... schema = 1
        ... robots = [{ model = "free_camera" }]
        ... objects = [{ name = "dots", marks = ["0, 0, 1 m", "10, 0, 100 cm"] }]
        ... cameras = [{ name = "eye", on = "free_camera.body", focal = 800, size = [640, 480] }]
        ... task = { kind = "ibvs", gain = 2 }
        ... ''').task.gain
        2.0
        """
        if not isinstance(source, str):
            raise InputError(f"source: expected a text, got {said(source)}")
        if not isinstance(text, str):
            raise FileError(f"{source}: expected TOML text, got {said(text)}")
        tables = parse(text, source)
        other = changed(tables, set, source)
        return cls._of_tables(other, source, text if other is tables else None)

    @classmethod
    def _of_tables(cls, tables: Tables, source: str, text: str | None) -> Self:
        read = read_experiment(tables, source)
        try:
            made = cls(**read, source=source)
        except InputError as error:
            raise FileError(f"{source}: {error}" if source else str(error)) from None
        objects = {GROUPS.get(key) for key, raw in tables.items() if isinstance(raw, Live)}
        if objects:  # which are written anew, as far as a text can say them
            kept = {key: raw for key, raw in tables.items() if key in GROUPS}
            kept = {key: raw for key, raw in kept.items() if GROUPS[key] not in objects}
            made.__dict__["_kept"] = kept
        else:
            made.__dict__["tables"] = tables
        if text is not None:
            made.__dict__["text"] = text
        return made

    @cached_property
    def tables(self) -> Tables:
        """The tables of the text, in which an object that no text can say stands as it is."""
        own = write_experiment(self, live=True)
        kept = self.__dict__.get("_kept", {})
        groups = {GROUPS.get(key) for key in kept}
        return {**{key: x for key, x in own.items() if GROUPS.get(key) not in groups}, **kept}

    def with_(self, **changes: Any) -> Self:
        """Return a copy with other fields: `experiment.with_(task=PBVS(), dt=0.02)`.

        InputError: there is no such field.
        """
        made = super().with_(**changes)
        gone = {*changes, *(["belief"] if changes.keys() & {"scene", "task"} else [])}
        said = self.__dict__.get("tables", self.__dict__.get("_kept", {}))
        kept = {key: x for key, x in said.items() if key in GROUPS and GROUPS[key] not in gone}
        made.__dict__["_kept"] = kept
        return made

    @cached_property
    def text(self) -> str:
        """The TOML text of this experiment: as it was read, or exact.

        InputError: the experiment is made of Python code, or has several starts.
        """
        if self.varied or np.ndim(self.start) > 1:
            return self.to_toml()
        own = self.__dict__.get("tables")
        return self.to_toml() if own is None or has_objects(own) else write(own)

    def to_toml(self, *, complete: bool = False, folder: str | os.PathLike[str] = ".") -> str:
        """Return it as TOML, as short as a person writes it; reading it gives the same experiment.

        complete  robots link by link and every default, for files that must last: such a text
                  needs no library and no URDF file, which may change
        folder    of the file that the text is for: paths of URDF files are relative to it

        A robot of the library or of a URDF file is called by its name there, with what was changed
        of it, and a belief says where it differs from the scene. Numbers are exact, in the units
        that make them shortest. Where no short text gives the same experiment, it is complete.

        InputError: the experiment is made of Python code, or has several starts or other numbers
        in each run.

        >>> from robsim import examples, load_scenario
        >>> experiment = load_scenario(examples.path("eye_in_hand")).at("task.gain", 2)
        >>> text = experiment.to_toml()
        >>> len(text.splitlines()) < 40 < 400 < len(experiment.to_toml(complete=True).splitlines())
        True
        """
        if self.varied:
            raise InputError("a text is of one run, and numbers differ from run to run: of_run(i)")
        whole = text_of(self)
        return whole if complete else brief_text(self, Path(folder)) or whole

    @cached_property
    def hash(self) -> str:
        """The first 16 hexadecimal digits of the hash of the exact text.

        InputError: there is no text.
        """
        return hashlib.sha256(self.to_toml(complete=True).encode()).hexdigest()[:16]

    def at(self, name: str | Mapping[str, Any], value: Any = None) -> Self:
        """Return a copy in which what has this dotted name has another value.

        name    such as "task.gain", "run.dt", "cameras.eye.focal" or "belief.robots.arm.links.
                elbow.dh.a"; or several of them, {name: value}
        value   a number in SI, a text as in a file ("20 ms"), or an object (`rs.PBVS()`); None:
                as if nothing was said

        FileError: there is no such name, with the nearest; or the value is not valid there.
        """
        if not isinstance(name, str | Mapping):
            raise InputError(f"expected a dotted name such as 'task.gain', got {said(name)}")
        changes = dict(name) if isinstance(name, Mapping) else {name: value}
        several = np.ndim(self.start) > 1  # which no table says
        own = {key: x for key, x in self.tables.items() if not (several and key == "start")}
        made = self._of_tables(changed(own, changes, self.source, python=True), self.source, None)
        varied = {each: x for each, x in self.varied.items() if each not in changes}
        made = made.with_(start=self.start) if several else made
        return made.with_(varied=varied) if varied else made

    def controls(self) -> list[Control]:
        """Return the values that a person may change by hand, as their declarations say them.

        `at` takes what the control of a value makes of another one: `control.changes(value)`.

        >>> from robsim import examples, load_scenario
        >>> experiment = load_scenario(examples.path("visp_tutorial"))
        >>> gain = next(each for each in experiment.controls() if each.path == "task.gain")
        >>> gain.value, gain.unit, gain.meaning
        (0.5, 'per second', 'Rate at which e falls: a constant, or adaptive.')
        >>> experiment.at(gain.changes(2.0)).task.gain
        2.0
        """
        return list(experiment_controls(self))

    def vary(self, numbers: Mapping[str, Any]) -> Self:
        """Return a copy of many runs, in which these names have another value in each run.

        numbers  {name: (runs, ...)} in SI, with the dotted names of `at`: intrinsics, distortion
                 and pose of cameras, marks and pose of objects, pose of robots, constants of links
                 ("belief.robots.arm.links.elbow.dh.a"), each true or believed; "task.gain",
                 "task.depth_scale", "actuation.lag", "sensing.noise", "sensing.latency" and others

        They are bound at once, so that 10,000 runs with 10,000 calibrations take little longer than
        with one. There is one start for all runs, or one for each. `of_run(i)` is the experiment of
        one run, with the same bits. The run has a variable for each name.

        InputError, FileError: a name that cannot differ from run to run, or a value that is not
        valid there.

        >>> from robsim import examples, load_scenario
        >>> experiment = load_scenario(examples.path("calibration_errors"))
        >>> wrong = experiment.vary({"belief.cameras.camera.focal": [490, 500, 510]})
        >>> wrong.run(record="summary").distance_to_goal.values.round(3)
        array([0.02, 0.  , 0.02])
        """
        return self.with_(varied={**self.varied, **checked(self, numbers)})

    def of_run(self, number: int) -> Self:
        """Return the experiment of a single run, by its place among the runs, from 0 on.

        InputError: there are not so many.
        """
        i = whole(number, "run", 0, self.runs)
        numbers = {name: values[i] for name, values in self.varied.items()}
        one = self.at(numbers) if numbers else self
        start = self.start[i] if np.ndim(self.start) > 1 else self.start
        return one.with_(start=start, first_run=self.first_run + i)
