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
    at, square, mark = get(w, ITERATION), get(w, SQUARE), get(w, REFERENCE)
    last, best = get(w, SEARCH) > get(w, RESTARTS), get(w, BEST)
    looks = (at == PERIOD * floor(at / PERIOD)) & ~last
    stuck = looks & (at > 0.0) & (square > FALL * mark)
    put(w, REFERENCE, where(looks, square, mark))
    put(w, ITERATION, at + 1.0)
    most = get(w, MOST_ITERATIONS)
    over = stuck | (get(w, STILL) > 0.0) | (at >= where(last, LAST_SEARCH_FACTOR * most, most))
    runs, there = get(w, RUN) >= 0.0, get(w, ERROR) < get(w, TOLERANCE)
    books = runs & (over | there | last) & (square < best)
    put(w, STORES_RESULT, where(books, 1.0, 0.0))
    put(w, BEST, where(books, square, best))
    goes = runs & ~over & ~there
    turn = where(goes, 1.0 * STEP, where(last | there, 1.0 * DONE, 1.0 * OVER))
    turn = where(goes & last & (square > get(w, BEST)), 1.0 * BACK, turn)
    put(w, ACTION, where(runs, turn, 1.0 * IDLE))
    for row in range(qd, qd + n):
        put(w, row, where(turn == STEP, get(w, row), 0.0))


@stage
def adapt_damping(w, step):
    """Adapt the damping of the last search by the ratio of the actual to the predicted decrease.

    See K. Madsen, H. B. Nielsen and O. Tingleff, Methods for non-linear least squares problems,
    2004, section 3.2.
    """
    turn, boost, hoped = get(w, ACTION), get(w, BOOST), get(w, PREDICTED_GAIN)
    goes = (get(w, SEARCH) > get(w, RESTARTS)) & ((turn == STEP) | (turn == BACK))
    mark, began = get(w, REFERENCE), get(w, ITERATION) <= 1.0
    fell, less = mark - get(w, SQUARE), boost / 3.0
    lighter = where(fell > 0.75 * hoped, where(less > 1.0, less, 1.0), boost)
    other = where(fell < 0.25 * hoped, 4.0 * boost, lighter)
    put(w, BOOST, where(goes & ~began, other, boost))
    put(w, REFERENCE, where(goes, get(w, BEST), mark))
    put(w, PREDICTED_GAIN, where(goes, get(w, GAIN), hoped))
