"""The variables of a simulation, which are computed one by one or all at once."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from functools import cache, cached_property
from typing import Any

import numpy as np
import xarray as xr

from robsim.base.arrays import Array
from robsim.engine.loop import Loop
from robsim.engine.recorder import RecordedSeries
from robsim.files.run_schema import get_variable_dimensions
from robsim.run.end_variables import list_end_variables
from robsim.run.frame_motion import compute_frame_motion
from robsim.run.simulation_coordinates import list_coordinates, make_index
from robsim.run.task_error import make_error_variables
from robsim.run.variable_descriptions import VariableDescriptions
from robsim.world.scene import Scene

VARIED = {"long_name": "number that differs from run to run, see Experiment.vary"}
Makers = dict[str, Callable[[], Array]]

# Others are computed from these later, and a user may edit in place what was read.
SOURCES = {"q", "qd", "qd_actual", "s", "s_goal", "pixels", "pixels_goal", "pixels_end"}
SOURCES |= {"q0", "q_end", "outcome"}


class SimulationVariables:
    """Variables and coordinates of a simulation, each computed at most once.

    A variable that was read alone is the same object in the Dataset of all variables.
    """

    def __init__(self, loop: Loop, scene: Scene, varied: Mapping[str, Array]) -> None:
        self.loop, self.scene, self.varied = loop, scene, varied
        single, summary = loop.single, loop.recorder.every is None
        self.absent = {dim for dim, gone in (("run", single), ("time", summary)) if gone}
        self.made: dict[str, xr.Variable] = {}
        self.indexes: dict[str, xr.Index] = {}

    def dataset(self) -> xr.Dataset:
        """Return the Dataset of all variables."""
        variables = {name: self._get_variable(name) for name in self.makers}
        coordinates, indexes = self._get_coordinates(self.coordinates)
        return xr.Dataset._construct_direct(  # the constructor checks each variable again
            {**variables, **coordinates}, set(coordinates), indexes=indexes
        )

    def single(self, name: str) -> xr.DataArray | None:
        """Return a variable with its coordinates, or None without such a variable."""
        if name not in self.end_makers and name not in self.makers:
            return None
        variable = self._get_variable(name)
        dims = self.absent.union(variable.dims)
        coordinates, indexes = self._get_coordinates(
            each for each, (own, *_) in self.coordinates.items() if dims.issuperset(own)
        )
        return xr.DataArray(variable, coordinates, name=name, indexes=indexes, fastpath=True)

    def list_all(self) -> dict[Hashable, xr.Variable]:
        """Return all variables by name, coordinates included."""
        return dict(self.dataset().variables)

    def _get_coordinates(
        self, names: Iterable[str]
    ) -> tuple[dict[str, xr.Variable], dict[Hashable, xr.Index]]:
        """Return some coordinates, and the indexes of those that have one."""
        coordinates = {name: self._get_coordinate(name) for name in names}
        return coordinates, {name: x for name, x in self.indexes.items() if name in coordinates}

    def _get_variable(self, name: str) -> xr.Variable:
        """Return a variable, which is computed at the first call."""
        if name not in self.made:
            with np.errstate(over="ignore", invalid="ignore"):  # runs may end with NaN or infinity
                data = (self.end_makers.get(name) or self.makers[name])()
            if name in SOURCES:
                data = data.copy()
            if name in self.varied:
                dims, attributes = ("run", *(f"{name}.{i}" for i in range(1, data.ndim))), VARIED
            else:
                dims = get_variable_dimensions(name, data.ndim)
                attributes = self.descriptions.describe(name)
            self.made[name] = xr.Variable(*self._drop_dimensions(dims, data), attributes)
        return self.made[name]

    def _get_coordinate(self, name: str) -> xr.Variable:
        """Return a coordinate, which is computed at the first call, and store its index."""
        if name not in self.made:
            own, make, *attributes = self.coordinates[name]
            dims, data = self._drop_dimensions(own, make())
            if (name,) == tuple(dims):
                self.indexes[name], self.made[name] = make_index(name, data, *attributes)
            else:
                self.made[name] = xr.Variable(dims, data, *attributes)
        return self.made[name]

    @cached_property
    def end_makers(self) -> Makers:
        """Functions that return the variables with one value per run, which need no series."""
        return list_end_variables(self.loop)

    @cached_property
    def makers(self) -> Makers:
        """Functions that return the variables, in the order of the Dataset."""
        series, controller = self.series, self.loop.controller
        s_goal = controller.s_goal.T  # (1, k), or (runs, k)
        return {
            **self._list_motions(),
            **self._list_errors(s_goal[:, None]),
            "pixels": lambda: series.pixels.reshape(*series.q.shape[:2], -1, 2),
            **_list_recorded(picture_hash=series.hashes, normal_factor=series.factors),
            **_list_recorded(active=series.active, slack=series.slack),
            **self._list_drives(),
            "pixels_goal": lambda: controller.goal_pixels,
            "s_goal": lambda: s_goal if len(s_goal) > 1 else s_goal[0],
            **self.end_makers,
            **{name: _return_array(values) for name, values in self.varied.items()},
        }

    @cached_property
    def coordinates(self) -> dict[str, Any]:
        """The coordinates, as `list_coordinates` returns them; a summary has no times."""
        every = list_coordinates(self.loop, self.scene)
        return {name: own for name, own in every.items() if name not in self.absent - {"run"}}

    @cached_property
    def descriptions(self) -> VariableDescriptions:
        """The attributes of all variables but the varied ones."""
        return VariableDescriptions(self.loop, self.scene)

    @cached_property
    def series(self) -> RecordedSeries:
        """The recorded instants; of a summary, the last one."""
        recorder = self.loop.recorder
        if recorder.every is None:
            return recorder.last
        instants = recorder.instants
        return RecordedSeries(*(part[:, :instants] for part in recorder.series))

    def _list_motions(self) -> Makers:
        """Return the functions of q, qd, and the poses and twists of the camera or the frame."""
        controller, series = self.loop.controller, self.series
        follows = series.rates.shape[-1] == 0
        whose = "camera" if controller.sights else "frame"
        rates = series.qd if follows else series.rates
        motion = cache(
            lambda: compute_frame_motion(controller.scene, controller.frame, series.q, rates)
        )
        return {
            "q": lambda: series.q,
            "qd": lambda: series.qd,
            **({} if follows else {"qd_actual": lambda: series.rates}),
            f"{whose}_pose": lambda: motion()[0],
            f"{whose}_velocity": lambda: motion()[1],
        }

    def _list_errors(self, s_goal: Array) -> Makers:
        """Return the functions of the features, the error and its norm."""
        series = self.series
        errors = cache(lambda: make_error_variables(series, s_goal))
        return {
            "s": lambda: series.s,
            **_list_recorded(weight=series.weights),
            "error": lambda: errors()["error"],
            "error_norm": lambda: errors()["error_norm"],
            "lyapunov": lambda: errors()["lyapunov"],
        }

    def _list_drives(self) -> Makers:
        """Return the functions of torques, their saturation and their limits, if any."""
        driven, series = self.loop.driven, self.series
        if driven is None or not series.torque.shape[-1]:  # a log has no torques
            return {}
        limits = np.full(self.loop.scene.nv, np.nan)
        limits[driven.velocities] = driven.limits
        return _list_recorded(
            torque=series.torque, saturation=series.saturation, torque_limit=limits
        )

    def _drop_dimensions(self, dims: Sequence[str], data: Any) -> tuple[Sequence[str], Any]:
        """Return dimensions and data without the absent dimensions of size one."""
        if self.absent.isdisjoint(dims):
            return dims, data
        first = tuple(0 if dim in self.absent else slice(None) for dim in dims)
        return [dim for dim in dims if dim not in self.absent], data[first]


def _list_recorded(**arrays: Array) -> Makers:
    """Return functions that return these arrays, except empty ones."""
    return {name: _return_array(array) for name, array in arrays.items() if array.shape[-1]}


def _return_array(array: Array) -> Callable[[], Array]:
    """Return a function that returns an array."""
    return lambda: array
