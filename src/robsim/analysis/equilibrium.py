"""`Equilibrium` and `EquilibriumSet`: the result of `equilibria`."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal, get_args, overload

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
ROWS = 20  # most rows of the printed table
SAME_POSE = 1e-4  # largest difference of poses (4, 4) in one row, metres and radians


@dataclass(frozen=True, eq=False)
class Equilibrium(Value):
    """A state without commanded motion.

    Attributes
    ----------
    q : ndarray of shape (nq,)
        Coordinates of the scene.
    T_c_o : ndarray of shape (4, 4)
        Pose of the first target in the first camera.
    kind : str
        Kind of the equilibrium. "goal": e = 0. "false goal": e = 0 at another pose of the camera
        than the known goal pose (three points look the same from up to four poses). "minimum": e is
        not 0 and all motions decay, a trap. "saddle": some motions decay and some grow. "source":
        all motions grow. "degenerate": some motions neither decay nor grow, as along a curve of
        equilibria. "not smooth": the vector field f has no derivative.
    error_norm : float
        ||e||, in the unit of the features.
    eigenvalues : ndarray of complex of shape (n,)
        Eigenvalues of the closed loop df/dq in 1/s, in ascending order of the real part. NaN if f
        has no derivative. A unicycle has one coordinate more than velocities, which adds an
        eigenvalue 0.
    free : int
        Number of eigenvalues that count as zero: their magnitude is below 1e-4 of the slowest
        nominal decay rate of the error (the gain, unless the inverse is the transpose).
    inside : bool
        Whether all joints are within their limits and all marks in their images.
    share : float
        Share of the runs that ended at this equilibrium, 0 to 1.

    Examples
    --------
    >>> import robsim as rs
    >>> scenario = rs.load_scenario(rs.examples.path("local_minimum"))
    >>> goal = rs.equilibria(scenario.scene, scenario.task, count=40).goal
    >>> goal.kind, goal.stable, goal.inside
    ('goal', True, True)
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
        return _format_row([self])


def _format_row(group: list[Equilibrium]) -> str:
    """Return the row of equilibria that differ only in the coordinates of the joints."""
    first, share = group[0], sum(each.share for each in group)
    pose = Pose(first.T_c_o)
    position, rotation = (
        " ".join(f"{x:8.4f}" for x in part) for part in (pose.position, pose.rotvec)
    )
    values, eigenvalues = "no derivative", np.array([each.eigenvalues for each in group])
    if np.isfinite(eigenvalues).all():
        low, high = (np.array([eigenvalues.real.min(), eigenvalues.real.max()]) + 0.0).round(4)
        turns = " *" if (np.abs(eigenvalues.imag) > 1e-6).any() else ""
        values = f"{low:9.4f} to {high:8.4f}{turns}"
    suffix = "" if first.inside else "  outside"
    if len(group) > 1:
        suffix += f"  in {len(group)} postures"
    row = f"{first.kind:11}{share:7.1%}{first.error_norm:11.3g}  {values:23}"
    return f"{row}  {position} |{rotation}{suffix}"


def _group_postures(found: Iterable[Equilibrium]) -> list[list[Equilibrium]]:
    """Return the equilibria in groups of one kind and one pose of the target in the camera."""
    groups: list[list[Equilibrium]] = []
    for each in found:
        for group in groups:
            same = (group[0].kind, group[0].inside) == (each.kind, each.inside)
            if same and np.abs(group[0].T_c_o - each.T_c_o).max() < SAME_POSE:
                group.append(each)
                break
        else:
            groups.append([each])
    return groups


@dataclass(frozen=True, eq=False)
class EquilibriumSet(Value, Sequence[Equilibrium]):
    """Equilibria of a task: goals first, then minima, then the unstable equilibria.

    `print` shows a table. Each row has the kind, the share of the starts, ||e||, the smallest and
    the largest real part of the eigenvalues (* marks complex eigenvalues), the pose of the target
    in the camera as position and rotation vector, and "outside" if a joint limit or an image border
    is exceeded. An arm may reach one pose in several postures, such as elbow up and elbow down.
    Such equilibria share a row, with the sum of their shares and the range of all eigenvalues.

    Attributes
    ----------
    found : tuple of Equilibrium
        The equilibria.
    starts : ndarray of shape (B, nq)
        Starts of the runs.
    ends : ndarray of int of shape (B,)
        Index in `found` of the equilibrium at the end of each run; -1 if the run ended elsewhere.
    outcomes : ndarray of int of shape (B,)
        `Outcome` of each run.

    Examples
    --------
    >>> import robsim as rs
    >>> scenario = rs.load_scenario(rs.examples.path("local_minimum"))
    >>> result = rs.equilibria(scenario.scene, scenario.task, count=40)
    >>> len(result.starts), result.minima[0].kind, round(result.lost, 3)
    (40, 'minimum', 0.0)
    """

    found: tuple[Equilibrium, ...]
    starts: Array
    ends: NDArray[np.int64]
    outcomes: NDArray[np.int8]

    @overload
    def __getitem__(self, index: int) -> Equilibrium: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[Equilibrium, ...]: ...
    def __getitem__(self, index: int | slice) -> Equilibrium | tuple[Equilibrium, ...]:
        return self.found[index]

    def __len__(self) -> int:
        return len(self.found)

    def of(self, kind: EquilibriumKind) -> tuple[Equilibrium, ...]:
        """Return all equilibria of one kind.

        Parameters
        ----------
        kind : str
            Kind, as in `Equilibrium`.

        Returns
        -------
        tuple of Equilibrium
            The equilibria of the kind, in their order; empty if there are none.
        """
        return tuple(each for each in self.found if each.kind == kind)

    @property
    def goal(self) -> Equilibrium:
        """The goal. Raises InputError if the search found no state with zero error."""
        for each in self.found:
            if each.kind == "goal":
                return each
        raise InputError(
            "the search found no equilibrium with zero error: the goal may be out of reach"
        )

    @property
    def minima(self) -> tuple[Equilibrium, ...]:
        """The minima with non-zero error, where runs get stuck."""
        return self.of("minimum")

    @property
    def saddles(self) -> tuple[Equilibrium, ...]:
        """The saddles, which attract along some directions and repel along others."""
        return self.of("saddle")

    @property
    def lost(self) -> float:
        """The share of the runs that ended at none of the equilibria."""
        return float((self.ends < 0).mean())

    def __str__(self) -> str:
        head = f"{len(self)} equilibria; runs from {len(self.starts)} starts"
        columns = (
            f"{'kind':11}{'share':>7}{'||e||':>11}  {'eigenvalues (1/s)':23}  "
            "target in camera (m | rad)"
        )
        groups = _group_postures(self.found)
        rows = [head, columns, *map(_format_row, groups[:ROWS])]
        if len(groups) > ROWS:
            rows.append(f"... and {sum(map(len, groups[ROWS:]))} more")
        if self.lost:
            ended, counts = np.unique(self.outcomes[self.ends < 0], return_counts=True)
            each = zip(ended, counts, strict=True)
            why = ", ".join(f"{n} {Outcome(int(end)).words}" for end, n in each)
            rows.append(f"{'elsewhere':11}{self.lost:7.1%}  {why}")
        return "\n".join(rows)
