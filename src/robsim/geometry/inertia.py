"""Inertia of a rigid body: mass, centre of mass and inertia tensor."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array, as_floats, as_positive, make_read_only
from robsim.base.errors import InputError
from robsim.base.parameter_names import name_parameters
from robsim.base.value import Value
from robsim.declare import Quantity, Role, Vector
from robsim.declare.spec import Context
from robsim.geometry.pose import PoseLike, check_single_pose

MOMENT_SLACK = 1e-9  # relative tolerance of the symmetry and of the inequalities of the moments
MOMENTS = Vector("inertia")
Triple = Array | tuple[float, ...]  # three numbers


@dataclass(frozen=True)
class InertiaTable:
    """Text form of an inertia: mass, centre, and moments and products of the tensor."""

    mass: Annotated[float, Quantity(above=0, dimension="mass"), Role.FILE, "Mass of the body."]
    moments: Annotated[
        Triple, MOMENTS, Role.FILE, "Moments ixx, iyy, izz about the centre of mass."
    ]
    centre: Annotated[Triple, Vector("length"), Role.FILE, "Centre of mass."] = (0.0, 0.0, 0.0)
    products: Annotated[
        Triple, MOMENTS, Role.FILE, "Products ixy, ixz, iyz of the tensor about the centre of mass."
    ] = (0.0, 0.0, 0.0)

    def build_value(self, c: Context) -> Inertia:
        """Return the inertia that the table describes."""
        tensor = np.diag(self.moments)
        for (i, j), product in zip(_PRODUCTS, self.products, strict=True):
            tensor[i, j] = tensor[j, i] = product
        return Inertia(self.mass, self.centre, tensor)

    @classmethod
    def of(cls, value: Inertia, c: Context) -> InertiaTable:
        """Return the table that describes an inertia."""
        products = tuple(value.tensor[i, j] for i, j in _PRODUCTS)
        return cls(value.mass, value.tensor.diagonal(), value.centre, products)


_PRODUCTS = (0, 1), (0, 2), (1, 2)


@name_parameters
@dataclass(frozen=True, eq=False)
class Inertia(Value):
    """Mass, centre of mass and inertia tensor of a rigid body.

    The sum `a + b` of two inertias in one frame is the inertia of both bodies, joined rigidly.

    Parameters
    ----------
    mass : float
        Mass in kg, above 0.
    centre : array_like of shape (3,), default (0, 0, 0)
        Centre of mass in metres, in the frame of the body.
    tensor : array_like of shape (3, 3)
        Inertia tensor about the centre of mass, in the axes of the frame of the body, in kg m^2.
        The diagonal of a ball of radius r is 2/5 m r^2.

    Raises
    ------
    InputError
        If no rigid body has this inertia: the mass is not positive, the tensor is missing or not
        symmetric, or a principal moment is negative or exceeds the sum of the other two.

    Examples
    --------
    >>> ball = Inertia(2.0, tensor=0.8 * np.eye(3))
    >>> (ball + ball).tensor.diagonal()
    array([1.6, 1.6, 1.6])
    """

    mass: float
    centre: Array = (0.0, 0.0, 0.0)  # type: ignore[assignment]  # converted below
    tensor: Array = None  # type: ignore[assignment]  # required, checked below
    text_form: ClassVar[type[Any]] = InertiaTable

    if TYPE_CHECKING:  # the types of the arguments are wider than the types of the attributes

        def __init__(
            self, mass: float, centre: ArrayLike = (0.0, 0.0, 0.0), tensor: ArrayLike | None = None
        ) -> None: ...

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "mass", as_positive(self.mass, "mass"))
        put(self, "centre", make_read_only(_read_fixed_array(self.centre, "centre of mass", (3,))))
        if self.tensor is None:
            raise InputError("inertia needs a tensor: 3 x 3, about the centre of mass, in kg m^2")
        tensor = _read_fixed_array(self.tensor, "inertia tensor", (3, 3))
        _check_inertia_tensor(tensor)
        put(self, "tensor", make_read_only((tensor + tensor.T) / 2))

    def __add__(self, other: Inertia) -> Inertia:
        """Return the inertia of two rigidly joined bodies, both given in the same frame.

        Both tensors are moved to the common centre of mass by the parallel axis theorem,
        I_P = I_C + m (r'r 1 - r r'), for a point P at r from the centre C (Goldstein, Classical
        Mechanics, section 5.3).
        """
        if not isinstance(other, Inertia):
            return NotImplemented
        mass = self.mass + other.mass
        centre = (self.mass * self.centre + other.mass * other.centre) / mass
        return Inertia(mass, centre, self._tensor_about(centre) + other._tensor_about(centre))

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
        return Inertia(self.mass, transform @ self.centre, R @ self.tensor @ R.T)

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


def _check_inertia_tensor(tensor: Array) -> None:
    """Raise InputError unless a rigid body can have this tensor."""
    skew = np.abs(tensor - tensor.T).max()
    if skew > MOMENT_SLACK * np.abs(tensor).max():
        raise InputError(f"inertia tensor: not symmetric, by {skew:.3g} kg m^2")
    low, middle, high = np.linalg.eigvalsh(tensor)
    moments = f"principal moments {low:.6g}, {middle:.6g}, {high:.6g} kg m^2"
    if low < -MOMENT_SLACK * high:
        raise InputError(f"inertia tensor: {moments}; none can be below 0")
    if high > (low + middle) * (1 + MOMENT_SLACK):
        raise InputError(f"inertia tensor: {moments}; none can exceed the sum of the other two")
