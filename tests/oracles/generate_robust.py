"""Oracle: robust weights, and the scale of deviations, by statsmodels; for Cauchy by mpmath.

Program: statsmodels and mpmath (`pip install statsmodels mpmath`); the version is in "made_by".
Run:     python tests/oracles/generate_robust.py
Writes:  robust_statsmodels.json, always the same numbers.

Of each kind the weights of residuals over their scale, and of lists of distances 1.4826 times the
median deviation from zero. Of Cauchy's loss c^2/2 ln(1 + (u/c)^2), which statsmodels lacks, the
weight is the derivative by u, in 40 digits by differences, over u.
"""

import numpy as np
import statsmodels
from _store import store
from mpmath import diff, log, mp, mpf
from statsmodels.robust import norms, scale

mp.dps = 40
NORMS = {"huber": norms.HuberT(1.345), "tukey": norms.TukeyBiweight(4.685)}
U = [0.0, 1e-9, 0.1, 0.5, 1.0, 1.344, 1.345, 1.346, 2.0, 3.3, 4.684, 4.685, 4.686, 9.0, 123.4, 1e9]


def cauchy(u):
    """rho'(u) / u; 1 at 0."""
    c = mpf("2.385")
    return float(diff(lambda x: c**2 / 2 * log(1 + (x / c) ** 2), mpf(u)) / mpf(u)) if u else 1.0


def main():
    rng = np.random.default_rng(2006)
    lists = [np.abs(rng.normal(size=n) * rng.choice([1, 30], n)) for n in (1, 2, 3, 4, 5, 8, 9, 40)]
    document = {
        "made_by": f"statsmodels {statsmodels.__version__}",
        "u": U,
        "weights": {name: norm.weights(np.array(U)).tolist() for name, norm in NORMS.items()}
        | {"cauchy": [cauchy(u) for u in U]},
        "scales": [
            {"distances": each.tolist(), "scale": float(scale.mad(each, center=0.0))}
            for each in lists
        ],
    }
    store("robust_statsmodels.json", document)


if __name__ == "__main__":
    main()
