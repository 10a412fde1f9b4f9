"""Oracle: volume, centre of mass and inertia of round solids, by integrals over their radius.

Program: mpmath, 40 digits.
Run:     python tests/oracles/generate_inertia.py
Writes:  inertia_mpmath.json

Each solid is given by its radius s(z); with density 1, its slice of thickness dz has the mass
pi s^2 dz and the moments pi s^4/4 dz about a diameter and pi s^4/2 dz about z. The integrals are
found by quadrature, not in closed form.
"""

from _store import store
from mpmath import mp, mpf, pi, quad, sqrt

mp.dps = 40


def integrate_solid(radius, ends):
    """Volume, height of the centre, and moments about the centre across and along z."""
    volume = quad(lambda z: pi * radius(z) ** 2, ends)
    centre = quad(lambda z: pi * radius(z) ** 2 * z, ends) / volume
    along = quad(lambda z: pi * radius(z) ** 4 / 2, ends)
    second = quad(lambda z: pi * radius(z) ** 2 * (z - centre) ** 2, ends)
    numbers = {"volume": volume, "centre": centre, "across": along / 2 + second, "along": along}
    return {name: float(value) for name, value in numbers.items()}


def capsule(r, h):
    r, h = mpf(r), mpf(h)

    def radius(z):
        beyond = max(abs(z) - h / 2, mpf(0))
        return sqrt(r**2 - beyond**2)

    return integrate_solid(radius, [-h / 2 - r, -h / 2, h / 2, h / 2 + r])


def tapered_cylinder(r, end, h):
    r, end, h = mpf(r), mpf(end), mpf(h)
    return integrate_solid(lambda z: r + (end - r) * (z / h + mpf(1) / 2), [-h / 2, h / 2])


CAPSULES = [("1", "2"), ("0.05", "0.4"), ("0.3", "0.01"), ("2e-3", "7")]
TAPERED = [("1", "0.5", "2"), ("0.04", "0.06", "0.3"), ("0.2", "1e-6", "0.1"), ("0.1", "0.1", "1")]

if __name__ == "__main__":
    store(
        "inertia_mpmath.json",
        {
            "capsules": [
                {"radius": float(r), "length": float(h), **capsule(r, h)} for r, h in CAPSULES
            ],
            "tapered_cylinders": [
                {"radius": float(r), "end_radius": float(e), "length": float(h)}
                | tapered_cylinder(r, e, h)
                for r, e, h in TAPERED
            ],
        },
    )
