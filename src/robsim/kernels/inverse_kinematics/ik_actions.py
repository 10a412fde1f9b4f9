"""What the search of inverse kinematics in each lane does next, and the rows in which it stands."""

from robsim.kernels.machine.lanes import floor, get, put, where
from robsim.kernels.machine.stages import stage

IDLE, STEP, BACK, OVER, DONE = 0, 1, 2, 3, 4  # what a lane does after an iteration
PERIOD, FALL = 4, 0.5  # a search goes on while e'e falls by this factor in so many iterations
LAST_SEARCH_FACTOR = (
    10  # times the iterations of others: the last search, which looks for the least error
)

# Rows of the block. Of a step: the error without weights, e'e, by how much that should fall, at
# least, how many joints are held, whether a step gains next to nothing.
ERROR, SQUARE, GAIN, HELD, STILL = 0, 1, 2, 3, 4
# Of a search: what its damping is boosted by; its run, or -1; its number, 0 from q0; its
# iterations; how far from the goal it began; the least e'e of the run; e'e some iterations ago; by
# how much it was to fall; what it does next; whether its coordinates are the best of the run.
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
# Of all searches: the tolerance of the error, the most iterations, how many begin elsewhere
TOLERANCE, MOST_ITERATIONS, RESTARTS = range(15, 18)
GOAL, Q = 18, 30  # the pose, in twelve rows, then the coordinates, and below them the step


@stage
def choose_action(w, step, qd="n", n="count"):
    """Set what each lane does: (the step, n), which is zero where it is not taken.

    A search ends where it is still, stuck, or too long, or at the goal.
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
    """Adapt the damping of the last search to the model.

    By the ratio of what was gained to what was promised (K. Madsen, H. B. Nielsen and O. Tingleff,
    Methods for non-linear least squares problems, 2004, section 3.2).
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
