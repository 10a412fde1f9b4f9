"""Oracle: first-order sensitivity indices of ranks, of functions that bend and wave, by SALib.

Program: SALib (`pip install SALib`); the version is in "made_by".
Run:     python tests/oracles/generate_sensitivities.py        (some seconds)
Writes:  sensitivities_salib.json, always the same numbers.

The inputs are independent and uniform. A result is replaced by its rank, divided by the number of
results, and Sobol's first-order index of the rank is the share of its variance that one input
explains: eta^2. "reference" holds the indices of the results themselves, by SALib and in closed
form for the function of Ishigami and Homma 1990 (Sobol and Levitan 1999, with a = 7, b = 0.1).
"""

from importlib.metadata import version

import numpy as np
from _store import store
from SALib.analyze import sobol as analysis
from SALib.sample import sobol as sample
from scipy.stats import rankdata

N, SEED = 2**16, 5
FUNCTIONS = {  # by name: bounds of each input, and the function of the columns
    "ishigami": (
        [[-np.pi, np.pi]] * 3,
        lambda a, b, c: np.sin(a) + 7 * np.sin(b) ** 2 + 0.1 * c**4 * np.sin(a),
    ),
    "waves": ([[0.0, 1.0]] * 3, lambda a, b, c: np.sin(8 * np.pi * a) + b + 0.1 * c),
    "steps": ([[0.0, 1.0]] * 3, lambda a, b, c: np.floor(6 * a) % 2 + np.exp(b) + 0 * c),
}


def indices(problem, results):
    """First-order indices and the half widths of their intervals."""
    how = {"calc_second_order": False, "seed": SEED, "num_resamples": 50}
    found = analysis.analyze(problem, results, **how)
    return found["S1"].tolist(), found["S1_conf"].tolist()


def case(name):
    """The indices of the ranks of a function, and of its results."""
    bounds, function = FUNCTIONS[name]
    problem = {"num_vars": 3, "names": ["a", "b", "c"], "bounds": bounds}
    x = sample.sample(problem, N, calc_second_order=False, seed=SEED)
    y = function(*x.T)
    eta_squared, half_width = indices(problem, rankdata(y) / len(y))
    return {
        "name": name,
        "bounds": bounds,
        "eta_squared": eta_squared,
        "half_width": half_width,
        "reference": indices(problem, y)[0],
    }


def main():
    a, b = 7.0, 0.1
    parts = [0.5 * (1 + b * np.pi**4 / 5) ** 2, a**2 / 8, 0.0]
    whole = a**2 / 8 + b * np.pi**4 / 5 + b**2 * np.pi**8 / 18 + 0.5
    document = {
        "made_by": f"SALib {version('SALib')}",
        "closed_form": {"ishigami": [part / whole for part in parts]},
        "functions": [case(name) for name in FUNCTIONS],
    }
    store("sensitivities_salib.json", document)


if __name__ == "__main__":
    main()
