"""Actions of the search of inverse kinematics in each lane, and the rows of its block."""

from robsim.kernels.machine.lanes import floor, get, put, where
from robsim.kernels.machine.stages import stage

IDLE, STEP, BACK, OVER, DONE = 0, 1, 2, 3, 4  # actions of a lane after an iteration
PERIOD, FALL = 4, 0.5  # a search continues while e'e falls by FALL in PERIOD iterations
LAST_SEARCH_FACTOR = 10  # factor on the iterations of the last search, which minimises the error

# Rows of a step: unweighted error; e'e; lower bound of the predicted decrease of e'e; number of
# held joints; 1 if the step is stationary.
ERROR, SQUARE, GAIN, HELD, STILL = 0, 1, 2, 3, 4
# Rows of a search: factor of the damping; run, or -1; index, 0 for the start q0; iterations;
# squared distance of its start from the goal; least e'e of the run; reference e'e of an earlier
# iteration; predicted decrease from the reference; action; 1 if its coordinates are the best of the
# run.
(
    BOOST,
    RUN,
    SEARCH,
    ITERATION,
    START_DISTANCE,
    BEST,
    REFERENCE,
    PREDICTED_GAIN,
    ACTION,
    STORES_RESULT,
) = range(5, 15)
# Rows of all searches: tolerance of the error; most iterations; number of further starts.
TOLERANCE, MOST_ITERATIONS, RESTARTS = range(15, 18)
GOAL, Q = 18, 30  # first row of the goal's pose (twelve rows); of the coordinates, then the step


@stage
def choose_action(w, step, qd="n", n="count"):
    """Choose the action of each lane. The step qd becomes zero unless the action is STEP.

    A search ends if it is stationary, stuck, too long, or at the goal.
    """
    iteration, square, reference = get(w, ITERATION), get(w, SQUARE), get(w, REFERENCE)
    last, best = get(w, SEARCH) > get(w, RESTARTS), get(w, BEST)
    is_check = (iteration == PERIOD * floor(iteration / PERIOD)) & ~last
    stuck = is_check & (iteration > 0.0) & (square > FALL * reference)
    put(w, REFERENCE, where(is_check, square, reference))
    put(w, ITERATION, iteration + 1.0)
    most = get(w, MOST_ITERATIONS)
    ends = (
        stuck | (get(w, STILL) > 0.0) | (iteration >= where(last, LAST_SEARCH_FACTOR * most, most))
    )
    runs, at_goal = get(w, RUN) >= 0.0, get(w, ERROR) < get(w, TOLERANCE)
    stores = runs & (ends | at_goal | last) & (square < best)
    put(w, STORES_RESULT, where(stores, 1.0, 0.0))
    put(w, BEST, where(stores, square, best))
    continues = runs & ~ends & ~at_goal
    action = where(continues, 1.0 * STEP, where(last | at_goal, 1.0 * DONE, 1.0 * OVER))
    action = where(continues & last & (square > get(w, BEST)), 1.0 * BACK, action)
    put(w, ACTION, where(runs, action, 1.0 * IDLE))
    for row in range(qd, qd + n):
        put(w, row, where(action == STEP, get(w, row), 0.0))


@stage
def adapt_damping(w, step):
    """Adapt the damping of the last search by the ratio of the actual to the predicted decrease.

    See K. Madsen, H. B. Nielsen and O. Tingleff, Methods for non-linear least squares problems,
    2004, section 3.2.
    """
    action, boost, predicted = get(w, ACTION), get(w, BOOST), get(w, PREDICTED_GAIN)
    adapts = (get(w, SEARCH) > get(w, RESTARTS)) & ((action == STEP) | (action == BACK))
    reference, is_first = get(w, REFERENCE), get(w, ITERATION) <= 1.0
    actual, smaller = reference - get(w, SQUARE), boost / 3.0
    decreased = where(actual > 0.75 * predicted, where(smaller > 1.0, smaller, 1.0), boost)
    adapted = where(actual < 0.25 * predicted, 4.0 * boost, decreased)
    put(w, BOOST, where(adapts & ~is_first, adapted, boost))
    put(w, REFERENCE, where(adapts, get(w, BEST), reference))
    put(w, PREDICTED_GAIN, where(adapts, get(w, GAIN), predicted))
