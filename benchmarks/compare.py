"""The cost of `compare` beside its simulations: image-based servoing under three L.

The compiled loop is the hardest case, since nothing simulates faster. Starts are spread so far that
most of them do not see the target; these end at once, and must cost next to nothing.
"""

import time

import numpy as np

import robsim as rs

SCENE = rs.load_scenario(rs.examples.path("visp_tutorial")).scene
GOAL = rs.Pose.at(0, 0, -0.75)
TASKS = {L: rs.IBVS(GOAL, interaction=L) for L in ("current", "desired", "mean")}
CASES = {"nearly all starts can begin": (0.02, 0.05), "most see nothing": (0.1, 0.3)}


def starts_about(goal, place, turn, runs):
    """Free cameras (runs, 7): displaced by normal deviates in metres, turned likewise in rad."""
    rng = np.random.default_rng(0)
    twists = rng.normal(size=(runs, 6)) * np.repeat([place, turn], 3)
    return (goal @ rs.Pose.exp(twists)).q


def seconds(work):
    """Processor time of all threads, which other work does not change; and the result."""
    begin = time.process_time()
    result = work()
    return time.process_time() - begin, result


def measured(starts, **settings):
    """The best of three of each side, in turns: simulations, comparison, and how many began."""
    alone, beside = [], []
    for _ in range(3):
        runs = [
            seconds(lambda t=t: rs.simulate(SCENE, t, starts, **settings)) for t in TASKS.values()
        ]
        alone.append(sum(run[0] for run in runs))
        del runs
        took, found = seconds(lambda: rs.compare(SCENE, TASKS, starts, **settings))
        beside.append(took)
        began = int(found.began()[0])
        del found
    return min(alone), min(beside), began


def main(runs=3000):
    """Print a table of seconds and ratios."""
    settings = {"duration": 8.0, "dt": 0.04}
    rs.compare(SCENE, TASKS, np.stack([GOAL.q] * 300), **settings)  # compiles
    print(f"{'starts':30}{'began':>7}{'alone, s':>10}{'compared':>10}{'ratio':>7}")
    for name, spread in CASES.items():
        alone, beside, began = measured(starts_about(GOAL, *spread, runs), **settings)
        print(f"{name:30}{began:7}{alone:10.2f}{beside:10.2f}{beside / alone:7.2f}")


if __name__ == "__main__":
    main()
