"""Features of all pixels of a picture, which act as normal equations of seven numbers."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import KW_ONLY, dataclass, field
from functools import cached_property
from typing import Annotated, ClassVar, Literal, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.base.value import replace_unchecked
from robsim.declare import Number, Time
from robsim.features.feature import Observation
from robsim.features.images.picture_feature import LEAST_CONTRAST, Border, Level, PictureFeature
from robsim.kernels.formulas.perspective import IN_IMAGE, NO_GRADIENT, NOTHING_IN_VIEW
from robsim.kernels.image_features.normal_equations import factor_normal_equations

InteractionModel = Literal["current", "desired", "mean"]

NUMBERS = 7  # of the error: six that a motion of the camera changes, and the rest
# eigenvalues of L'L with a diagonal of ones, of a motion that a picture determines at the goal, and
# of one that it no longer determines; sums are in single precision
LEAST_EIGENVALUE, LOST_EIGENVALUE = 1e-4, 1e-6


class NormalEquations(NamedTuple):
    """Normal equations of the errors of B pictures, as means over the pixels.

    Attributes
    ----------
    H : ndarray of shape (B, 6, 6)
        L'L of the error e with edot = L V_c.
    g : ndarray of shape (B, 6)
        L'e.
    c : ndarray of shape (B,)
        e'e.
    """

    H: Array
    g: Array
    c: Array


class _Texture(NamedTuple):
    """The contrast (R,) of pictures, and the number (R,) of motions that they determine."""

    contrast: Array
    motions: NDArray[np.int64]

    def of_runs(self, seen: Observation) -> _Texture:
        """Return the texture of each observed run."""
        if len(self.contrast) == 1 or seen.runs is None:
            return self
        return _Texture(self.contrast[seen.runs], self.motions[seen.runs])


@dataclass
class _KnownResults:
    """Results of a feature for one observation."""

    feature: DenseFeature
    equations: NormalEquations | None = None
    reduced: tuple[Array, Array] | None = None


@dataclass(frozen=True, eq=False)
class DenseFeature(PictureFeature, ABC):
    """Base of features that compare all pixels of a picture with the picture at the goal.

    An error e of very many numbers with edot = L V_c enters the law as its normal equations: with
    the Cholesky factor R'R = L'L (as means over the pixels), the error has the seven numbers

        s = (R'^-1 L'e, rest),    |s|^2 = mean of e^2,

    and the interaction matrix [R; 0]. The law then commands -gain (L'L)^-1 L'e, and the norm of
    the error is the root mean square of e. As in the method of Levenberg and Marquardt, the law
    adds a share of the diagonal to L'L. It falls with the square of the error (Yamashita and
    Fukushima 2001, Computing Suppl. 15, 239), or at a time.
    """

    unit: ClassVar[str] = "grey"

    tolerance: Annotated[
        float,
        Number(above=0, unit="grey values"),
        "Largest root mean square of the difference of the pictures at convergence.",
    ] = 10.0
    _: KW_ONLY
    step: Annotated[
        float,
        Number(least=0, unit="m, rad"),
        "Largest remaining step of the camera at convergence; 0: the pictures alone decide.",
    ] = 1e-4
    border: Border = 10
    level: Level = 0
    damping: Annotated[
        float,
        Number(least=0),
        "Share of the diagonal of L'L that is added to it while the pictures differ by their "
        "contrast; it falls with the square of the difference.",
    ] = 0.01
    switch_time: Annotated[
        float | None,
        Time(least=0),
        "Time until which the damping is constant, and then `final_damping`; None: it falls with "
        "the difference.",
    ] = None
    final_damping: Annotated[
        float, Number(least=0), "Damping from `switch_time` on; not used without it."
    ] = 1e-4

    goal: Observation | None = field(default=None, init=False, repr=False)
    interaction_model: InteractionModel = field(default="current", init=False, repr=False)

    def with_interaction(self, model: InteractionModel) -> Self:
        """Return the feature with L at the goal, of the present picture, or the mean of both."""
        return replace_unchecked(self, interaction_model=model)

    @abstractmethod
    def compute_normal_equations(self, seen: Observation) -> NormalEquations:
        """Return the normal equations of the error of pictures."""

    def measure(self, seen: Observation) -> Array:
        """Return the errors.

        Parameters
        ----------
        seen : Observation
            Pictures of B runs.

        Returns
        -------
        ndarray of shape (B, 7)
            Error s in grey values, 0 at the goal.

        Raises
        ------
        InputError
            If there are no pictures, or no goal.
        """
        return self._reduce(seen)[0]

    def interaction(self, seen: Observation) -> Array:
        """Return the interaction matrix.

        Parameters
        ----------
        seen : Observation
            Pictures of B runs.

        Returns
        -------
        ndarray of shape (B, 7, 6)
            Cholesky factor of the normal equations, above a row of zeros.

        Raises
        ------
        InputError
            If there are no pictures, or no goal.
        """
        return self._reduce(seen)[1]

    def find_faults(self, seen: Observation) -> NDArray[np.int64]:
        """Return the status of each picture (B,): in view, without a gradient, or empty.

        Parameters
        ----------
        seen : Observation
            Pictures of B runs.

        Returns
        -------
        ndarray of int, shape (B,)
            IN_IMAGE, NO_GRADIENT or NOTHING_IN_VIEW of `robsim.kernels.formulas.perspective`.
        """
        texture = self._goal_texture.of_runs(seen)
        empty = self.measure_contrasts(self.get_pictures(seen)) < LEAST_CONTRAST * texture.contrast
        if self.has_constant_products:
            return np.where(empty, NOTHING_IN_VIEW, IN_IMAGE)
        flat = _count_motions(self._get_equations(seen).H, LOST_EIGENVALUE) < texture.motions
        return np.where(empty, NOTHING_IN_VIEW, np.where(flat, NO_GRADIENT, IN_IMAGE))

    @property
    def has_constant_products(self) -> bool:
        """Whether every picture has L'L of the goal."""
        return False

    @cached_property
    def _goal_texture(self) -> _Texture:
        """The texture of the pictures at the goal."""
        assert self.goal is not None
        motions = _count_motions(self._get_equations(self.goal).H, LEAST_EIGENVALUE)
        return _Texture(self.measure_contrasts(self.get_pictures(self.goal)), motions)

    def _reduce(self, seen: Observation) -> tuple[Array, Array]:
        """Return the errors (B, 7) and the interaction matrices (B, 7, 6) of pictures."""
        known = self._get_known_results(seen)
        if known.reduced is None:
            H, g, c = self._get_equations(seen)
            s, L = np.empty((len(c), NUMBERS)), np.empty((len(c), NUMBERS, 6))
            factor_normal_equations(H, g, c, s, L)
            known.reduced = s, L
        return known.reduced

    def _get_equations(self, seen: Observation) -> NormalEquations:
        """Return the normal equations of an observation, computed once."""
        known = self._get_known_results(seen)
        if known.equations is None:
            known.equations = self.compute_normal_equations(seen)
        return known.equations

    def _get_known_results(self, seen: Observation) -> _KnownResults:
        """Return the results for an observation, which it keeps for the feature."""
        known: _KnownResults | None = vars(seen).get("_dense_results")
        if known is None or known.feature is not self:
            known = vars(seen)["_dense_results"] = _KnownResults(self)
        return known

    def find_damping(self, seen: Observation) -> Array:
        """Return the share (B,) of the diagonal of L'L that the law adds to it."""
        c = self._get_equations(seen).c
        if self.switch_time is not None:
            late = seen.time >= self.switch_time
            return np.full(len(c), self.final_damping if late else self.damping)
        return self.damping * np.minimum(c / self.find_large_error(seen), 1.0)

    def find_large_error(self, seen: Observation) -> Array:
        """Return the mean squared errors (B,), or one for all runs, of pictures that differ."""
        return np.square(self._goal_texture.of_runs(seen).contrast)


def _count_motions(H: Array, least: float) -> NDArray[np.int64]:
    """Return the number (B,) of motions with an eigenvalue of L'L (B, 6, 6) above a share.

    All six count for a matrix that is not finite, which has no eigenvalues.
    """
    size = np.sqrt(np.diagonal(H, axis1=1, axis2=2))
    scale = np.where(size > 0.0, size, 1.0)
    normal = H / scale[:, :, None] / scale[:, None]
    is_finite = np.isfinite(normal).all(axis=(1, 2))
    counts = np.full(len(H), H.shape[1])
    counts[is_finite] = (np.linalg.eigvalsh(normal[is_finite]) > least).sum(axis=1)
    return counts
