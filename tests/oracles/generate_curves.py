"""Oracle: catenaries, their arc lengths, and chords between wheels on curves, by mpmath.

Program: mpmath, 40 digits.
Run:     python tests/oracles/generate_curves.py
Writes:  curves_mpmath.json

The catenary is found from its equation
y = a cosh((x - x0)/a) + c by a solver of its own and its arc length by numerical quadrature; the
chord by a search in two unknowns along curves that are given as functions of x or of an angle.
"""

from _store import store
from mpmath import asin, cos, cosh, findroot, mp, mpf, quad, sin, sinh, sqrt

mp.dps = 40


def catenary(start, end, length):
    """a, x0, c with y = a cosh((x - x0)/a) + c through both ends, of this length."""
    (x1, y1), (x2, y2) = start, end
    length = mpf(length)

    def gaps(a, x0):
        rise = a * (cosh((x2 - x0) / a) - cosh((x1 - x0) / a)) - (mpf(y2) - mpf(y1))
        way = a * (sinh((x2 - x0) / a) - sinh((x1 - x0) / a)) - length
        return rise, way

    h, v = mpf(x2) - mpf(x1), mpf(y2) - mpf(y1)
    ratio = sqrt(length**2 - v**2) / h
    z = findroot(lambda z: sinh(z) / z - ratio, sqrt(6 * (ratio - 1)))
    a0 = h / (2 * z)
    middle = (mpf(x1) + mpf(x2)) / 2
    a, x0 = findroot(gaps, (a0, middle - a0 * mp.atanh(v / length)), tol=1e-60)
    return a, x0, mpf(y1) - a * cosh((x1 - x0) / a)


def catenaries():
    cases = [
        ((0, 0), (10, 0), "10.2"),
        ((0, 0), (30, 2), "30.4"),
        ((-1, 3), (4, -2), "9"),
        ((0, 0), (100, 0), "100.0001"),
        ((0, 0), (1, 0), "12"),
    ]
    for start, end, length in cases:
        a, x0, c = catenary(start, end, length)
        points = []
        for share in ("0.1", "0.37", "0.5", "0.93"):
            x = start[0] + mpf(share) * (end[0] - start[0])
            s = quad(lambda t, a=a, x0=x0: sqrt(1 + sinh((t - x0) / a) ** 2), [start[0], x])
            slope = sinh((x - x0) / a)
            y = a * cosh((x - x0) / a) + c
            curvature = cosh((x - x0) / a) / a / (1 + slope**2) ** mpf("1.5")
            points.append([float(v) for v in (s, x, y, mp.atan(slope), curvature)])
        yield {
            "start": start,
            "end": end,
            "length": float(mpf(length)),
            "parameter": float(a),
            "points": points,
        }


def chords():
    """On a circle by elementary geometry, on a catenary by a search in x."""
    for radius, angle, wheel, length in ((3, 2, "0.1", "0.8"), (3, -2, "0.1", "0.8")):
        side = 1 if angle > 0 else -1
        r = radius - side * mpf(wheel)  # of the circle of the wheel centres
        half = asin(mpf(length) / (2 * r))
        at = mpf(length) / 4
        # the third wheel: on the circle, `at` along the chord
        depth = sqrt(r**2 - (mpf(length) / 2) ** 2)
        height = -side * (sqrt(r**2 - (at - mpf(length) / 2) ** 2) - depth)
        yield {
            "curve": "arc",
            "radius": radius,
            "angle": angle,
            "wheel": float(mpf(wheel)),
            "length": float(mpf(length)),
            "at": float(at),
            "s": 1.0,
            "arc": float(1 + radius * 2 * half),
            "turn": float(side * half),
            "third": float(1 + radius * (half - asin((mpf(length) / 2 - at) / r))),
            "height": float(height),
            "tilt": float(-side * asin((mpf(length) / 2 - at) / r)),
        }
    start, end, length = (0, 0), (30, 2), "30.4"
    a, x0, c = catenary(start, end, length)
    wheel, chord, at = mpf("0.05"), mpf("0.9"), mpf("0.3")

    def centre(x):
        f = mp.atan(sinh((x - x0) / a))
        return x - wheel * sin(f), a * cosh((x - x0) / a) + c + wheel * cos(f)

    def arc(x):
        return a * (sinh((x - x0) / a) - sinh((start[0] - x0) / a))

    for x1 in (mpf(2), mpf("13.7"), mpf(25)):
        p = centre(x1)
        far = lambda x, p=p: sqrt((centre(x)[0] - p[0]) ** 2 + (centre(x)[1] - p[1]) ** 2) - chord  # noqa: E731
        x2 = findroot(far, x1 + chord)
        P = centre(x2)
        u = ((P[0] - p[0]) / chord, (P[1] - p[1]) / chord)
        along = lambda x, p=p, u=u: (centre(x)[0] - p[0]) * u[0] + (centre(x)[1] - p[1]) * u[1] - at  # noqa: E731
        x3 = findroot(along, x1 + at)
        Q = centre(x3)
        yield {
            "curve": "catenary",
            "start": start,
            "end": end,
            "cable": float(mpf(length)),
            "wheel": float(wheel),
            "length": float(chord),
            "at": float(at),
            "s": float(arc(x1)),
            "arc": float(arc(x2)),
            "turn": float(mp.atan2(u[1], u[0]) - mp.atan(sinh((x1 - x0) / a))),
            "third": float(arc(x3)),
            "height": float(u[0] * (Q[1] - p[1]) - u[1] * (Q[0] - p[0])),
            "tilt": float(mp.atan(sinh((x3 - x0) / a)) - mp.atan2(u[1], u[0])),
        }


store("curves_mpmath.json", {"catenaries": list(catenaries()), "chords": list(chords())})
