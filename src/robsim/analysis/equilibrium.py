"""`Equilibrium` and `EquilibriumSet`: the result of `equilibria`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, get_args, overload

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.base.value import Value
from robsim.engine.outcome import Outcome
from robsim.geometry.pose import Pose

EquilibriumKind = Literal[
    "goal", "false goal", "minimum", "degenerate", "saddle", "source", "not smooth"
]
EQUILIBRIUM_KINDS: tuple[EquilibriumKind, ...] = get_args(EquilibriumKind)
ROWS = 20  # of the printed table, at most


@dataclass(frozen=True, eq=False)
class Equilibrium(Value):
    """A state in which a task commands no motion.

    q             coordinates (nq,) of the scene
    T_c_o         pose (4, 4) of the first target in the first camera
    kind          "goal": e = 0; "false goal": e = 0 with the camera elsewhere (three points
                  look alike from up to four poses), where the pose of the goal is known;
                  "minimum": e is not 0 and all motions decay, a trap; "saddle": some decay and some
                  grow; "source": all grow; "degenerate": some neither, one of a set of equilibria;
                  "not smooth": f has no derivative there
    error_norm    ||e||, in the unit of the features
    eigenvalues   (n,) of the closed loop df/dq, complex, per second, the slowest to decay last;
                  NaN where f has no derivative; a unicycle, which has one coordinate more than
                  velocities, adds a zero
    free          how many eigenvalues count as zero: below a ten-thousandth of the slowest rate at
                  which the error is to decay, which is the gain where the inverse is no transpose
    inside        whether all joints are within their limits and all marks in the images
    share         of the starts, whose runs ended there, 0 to 1
    """

    q: Array
    T_c_o: Array
    kind: EquilibriumKind
    error_norm: float
    eigenvalues: NDArray[np.complex128]
    free: int
    inside: bool
    share: float

    @property
    def stable(self) -> bool:
        """Whether every small motion decays."""
        return not self.free and bool((self.eigenvalues.real < 0).all())

    def __str__(self) -> str:
        pose = Pose(self.T_c_o)
        place, turn = (" ".join(f"{x:8.4f}" for x in part) for part in (pose.position, pose.rotvec))
        values = "no derivative"
        if np.isfinite(self.eigenvalues).all():
            low, high = (self.eigenvalues.real[[0, -1]] + 0.0).round(4)
            turns = " *" if (np.abs(self.eigenvalues.imag) > 1e-6).any() else ""
            values = f"{low:9.4f} to {high:8.4f}{turns}"
        away = "" if self.inside else "  outside"
        row = f"{self.kind:11}{self.share:7.1%}{self.error_norm:11.3g}  {values:23}"
        return f"{row}  {place} |{turn}{away}"


@dataclass(frozen=True, eq=False)
class EquilibriumSet(Value, Sequence[Equilibrium]):
    """The equilibria that were found: goals first, then minima, then the unstable ones.

    The table that `print` shows has in each row the kind, the share of the starts, ||e||, the
    smallest and the largest real part of the eigenvalues (* where some are complex), the pose of
    the target in the camera as position and rotation vector, and whether it is outside of the
    limits of a joint or of an image.

    found      the equilibria
    starts     (B, nq) where the runs started
    ends       (B,) number of the equilibrium at which each run ended; -1 for none of them
    outcomes   (B,) `Outcome` of each run
    """

    found: tuple[Equilibrium, ...]
    starts: Array
    ends: NDArray[np.int64]
    outcomes: NDArray[np.int8]

    @overload
    def __getitem__(self, index: int) -> Equilibrium: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[Equilibrium, ...]: ...
    def __getitem__(self, index: Any) -> Any:
        return self.found[index]

    def __len__(self) -> int:
        return len(self.found)

    def of(self, kind: EquilibriumKind) -> tuple[Equilibrium, ...]:
        """Return all equilibria of one kind."""
        return tuple(each for each in self.found if each.kind == kind)

    @property
    def goal(self) -> Equilibrium:
        """The goal; InputError if no state was found in which the error is zero."""
        for each in self.found:
            if each.kind == "goal":
                return each
        raise InputError("no equilibrium with error zero was found: the goal may be out of reach")

    @property
    def minima(self) -> tuple[Equilibrium, ...]:
        """The minima with non-zero error, at which runs end."""
        return self.of("minimum")

    @property
    def saddles(self) -> tuple[Equilibrium, ...]:
        """The saddles, which attract along some directions and repel along others."""
        return self.of("saddle")

    @property
    def lost(self) -> float:
        """The share of the starts whose runs ended at none of the equilibria."""
        return float((self.ends < 0).mean())

    def __str__(self) -> str:
        head = f"{len(self)} equilibria; runs from {len(self.starts)} starts"
        columns = (
            f"{'kind':11}{'share':>7}{'||e||':>11}  {'eigenvalues (1/s)':23}  "
            "target in camera (m | rad)"
        )
        rows = [head, columns, *map(str, self.found[:ROWS])]
        if len(self) > ROWS:
            rows.append(f"... and {len(self) - ROWS} more")
        if self.lost:
            ended, counts = np.unique(self.outcomes[self.ends < 0], return_counts=True)
            each = zip(ended, counts, strict=True)
            why = ", ".join(f"{n} {Outcome(int(end)).words}" for end, n in each)
            rows.append(f"{'elsewhere':11}{self.lost:7.1%}  {why}")
        return "\n".join(rows)
