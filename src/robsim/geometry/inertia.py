"""Inertia of a rigid body: mass, centre of mass and inertia tensor."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array, as_floats, as_nonnegative, make_read_only
from robsim.base.errors import InputError
from robsim.base.parameter_names import name_parameters
from robsim.base.value import Value
from robsim.declare import Flag, PerRun, Quantity, Role, Vector
from robsim.declare.context import Context
from robsim.geometry.pose import PoseLike, check_single_pose

MOMENT_SLACK = 1e-9  # relative tolerance of the symmetry and of the inequalities of the moments
# metres: a point at this distance from an axis has the moment that the inequalities tolerate in
# addition, m r^2. Centres of mass are not known to 0.1 mm, and moving the axis by so much changes
# the moments as much. Rounded zeros of CAD programs exceed the inequalities by m (1e-9 m)^2 at
# most, wrong tensors of published models by m (2.8 mm)^2 at least (example-robot-data 6.0.0).
LENGTH_SLACK = 1e-4
MOMENTS = Vector("inertia")
Triple = Array | tuple[float, ...]  # three numbers


@dataclass(frozen=True)
class InertiaTable:
    """Text form of an inertia: mass, centre, and moments and products of the tensor."""

    stands: ClassVar[Mapping[str, str]] = {"mass": "mass"}
    without_controls: ClassVar[Any] = ("moments", "centre", "products", "strict")

    mass: Annotated[
        float, Quantity(least=0, dimension="mass"), Role.DRIVE, PerRun(()), "Mass of the body."
    ]
    moments: Annotated[
        Triple, MOMENTS, Role.DRIVE, "Moments ixx, iyy, izz about the centre of mass."
    ]
    centre: Annotated[Triple, Vector("length"), Role.DRIVE, "Centre of mass."] = (0.0, 0.0, 0.0)
    products: Annotated[
        Triple,
        MOMENTS,
        Role.DRIVE,
        "Products ixy, ixz, iyz of the tensor about the centre of mass.",
    ] = (0.0, 0.0, 0.0)
    strict: Annotated[bool, Flag(), Role.DRIVE, "Whether only a rigid body is valid."] = True

    def build_value(self, c: Context) -> Inertia:
        """Return the inertia that the table describes."""
        tensor = np.diag(self.moments)
        for (i, j), product in zip(_PRODUCTS, self.products, strict=True):
            tensor[i, j] = tensor[j, i] = product
        return Inertia(self.mass, self.centre, tensor, strict=self.strict)

    @classmethod
    def of(cls, value: Inertia, c: Context) -> InertiaTable:
        """Return the table that describes an inertia."""
        products = tuple(value.tensor[i, j] for i, j in _PRODUCTS)
        moments, strict = value.tensor.diagonal(), value.defect is None
        return cls(value.mass, moments, value.centre, products, strict)


_PRODUCTS = (0, 1), (0, 2), (1, 2)


@name_parameters
@dataclass(frozen=True, eq=False)
class Inertia(Value):
    """Mass, centre of mass and inertia tensor of a rigid body.

    The sum `a + b` of two inertias in one frame is the inertia of both bodies, joined rigidly.

    The principal moments of a rigid body are not negative, and none exceeds the sum of the other
    two. Published numbers of robots violate this: identified parameters, tensors that were
    copied with a wrong sign or in wrong axes, and links of which only the moment about the axis of
    their joint is known. `strict=False` keeps such numbers as they are given, and `defect`
    describes the violation. They are useful, because the dynamics of a robot depend on sums of
    the inertias of its links; they require only that its mass matrix is positive definite.

    Parameters
    ----------
    mass : float
        Mass in kg, not below 0. An inertia without mass has a moment about one axis only.
    centre : array_like of shape (3,), default (0, 0, 0)
        Centre of mass in metres, in the frame of the body.
    tensor : array_like of shape (3, 3)
        Inertia tensor about the centre of mass, in the axes of the frame of the body, in kg m^2.
        The diagonal of a ball of radius r is 2/5 m r^2.
    strict : bool, default True
        Whether to require the principal moments of a rigid body. Excesses of 1e-9 of the largest
        moment plus m (0.1 mm)^2, by rounding, are valid.

    Raises
    ------
    InputError
        If the mass is negative, the tensor is missing or not symmetric, or all numbers are zero.
        If `strict`, also if no rigid body has this inertia.

    Examples
    --------
    >>> ball = Inertia(2.0, tensor=0.8 * np.eye(3))
    >>> (ball + ball).tensor.diagonal()
    array([1.6, 1.6, 1.6])
    >>> Inertia(0.0, tensor=np.diag([0, 0.35, 0])).defect is None  # about the axis of a joint
    True
    """

    mass: float
    centre: Array = (0.0, 0.0, 0.0)  # type: ignore[assignment]  # converted below
    tensor: Array = None  # type: ignore[assignment]  # required, checked below
    strict: bool = field(default=True, kw_only=True, compare=False, repr=False)
    text_form: ClassVar[type[Any]] = InertiaTable

    if TYPE_CHECKING:  # the types of the arguments are wider than the types of the attributes

        def __init__(
            self,
            mass: float,
            centre: ArrayLike = (0.0, 0.0, 0.0),
            tensor: ArrayLike | None = None,
            *,
            strict: bool = True,
        ) -> None: ...

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "mass", as_nonnegative(self.mass, "mass"))
        put(self, "centre", make_read_only(_read_fixed_array(self.centre, "centre of mass", (3,))))
        if self.tensor is None:
            raise InputError("inertia needs a tensor: 3 x 3, about the centre of mass, in kg m^2")
        tensor = _read_fixed_array(self.tensor, "inertia tensor", (3, 3))
        _check_symmetry(tensor)
        put(self, "tensor", make_read_only((tensor + tensor.T) / 2))
        if not self.mass and not tensor.any():
            raise InputError("inertia: the mass and all moments are 0; give None for no inertia")
        if self.strict and self.defect is not None:
            raise InputError(f"{self.defect}; strict=False keeps such an inertia")

    @cached_property
    def defect(self) -> str | None:
        """Reason why no rigid body has this inertia, or None if a body has it.

        Examples
        --------
        >>> Inertia(1.0, tensor=np.diag([1, 1, 3]), strict=False).defect.partition("; ")[2]
        'none can exceed the sum of the other two'
        """
        return _describe_defect(self.mass, self.tensor)

    def __add__(self, other: Inertia) -> Inertia:
        """Return the inertia of two rigidly joined bodies, both given in the same frame.

        Both tensors are moved to the common centre of mass by the parallel axis theorem,
        I_P = I_C + m (r'r 1 - r r'), for a point P at r from the centre C (Goldstein, Classical
        Mechanics, section 5.3).
        """
        if not isinstance(other, Inertia):
            return NotImplemented
        mass = self.mass + other.mass
        centre = self.centre
        if mass:
            centre = (self.mass * self.centre + other.mass * other.centre) / mass
        tensor = self._tensor_about(centre) + other._tensor_about(centre)
        return Inertia(mass, centre, tensor, strict=False)

    def at(self, pose: PoseLike) -> Inertia:
        """Return a copy that is moved rigidly by `pose`.

        Parameters
        ----------
        pose : Pose or array_like of shape (4, 4)
            Pose of the frame of the inertia in the frame of the result.

        Returns
        -------
        Inertia
            The same body, with centre and tensor in the new frame.

        Examples
        --------
        >>> from robsim.geometry.pose import Pose
        >>> Inertia(1, (1, 0, 0), np.eye(3)).at(Pose.at(0, 2, 0)).centre
        array([1., 2., 0.])
        """
        transform = check_single_pose(pose, "pose to move an inertia by")
        R = transform.rotation
        tensor = R @ self.tensor @ R.T
        return Inertia(self.mass, transform @ self.centre, tensor, strict=False)

    def _tensor_about(self, point: Array) -> Array:
        """Return the tensor about another point."""
        r = self.centre - point
        tensor: Array = self.tensor + self.mass * (r @ r * np.eye(3) - np.outer(r, r))
        return tensor


def _read_fixed_array(value: ArrayLike, what: str, shape: tuple[int, ...]) -> Array:
    """Return an array of exactly this shape, or raise an InputError that names `what`."""
    array = as_floats(value, what, shape)
    if array.shape != shape:
        raise InputError(f"{what}: expected shape {shape}, got {array.shape}")
    return array


def _check_symmetry(tensor: Array) -> None:
    """Raise InputError unless a tensor is symmetric."""
    skew = np.abs(tensor - tensor.T).max()
    if skew > MOMENT_SLACK * np.abs(tensor).max():
        raise InputError(f"inertia tensor: not symmetric, by {skew:.3g} kg m^2")


def _describe_defect(mass: float, tensor: Array) -> str | None:
    """Return the reason why no rigid body has this mass and tensor, or None.

    A massless inertia about one axis is valid: it is the limit of a ring of small mass and large
    radius, and contributes to the motion about its axis only.
    """
    low, middle, high = np.linalg.eigvalsh(tensor)
    moments = f"inertia tensor: principal moments {low:.6g}, {middle:.6g}, {high:.6g} kg m^2"
    slack = MOMENT_SLACK * max(-low, high) + mass * LENGTH_SLACK**2
    if low < -slack:
        return f"{moments}; none can be below 0"
    if not mass:
        several = middle > slack
        return f"{moments} without mass; only one can be above 0 then" if several else None
    if high > low + middle + slack:
        return f"{moments}; none can exceed the sum of the other two"
    return None
