"""The outcomes of a run as numbers, and the thresholds of the rules that decide them."""

RUNNING, CONVERGED, LOCAL_MINIMUM, OUT_OF_IMAGE, BEHIND_CAMERA = 0, 1, 2, 3, 4
JOINT_LIMIT, SINGULAR, DIVERGED, NOT_FINITE, TIME_LIMIT, ENDED = 5, 6, 7, 8, 9, 10
STALL_PERIODS = 10
STALL = 0.01  # of the tolerance; a run on its way moves the features by about its error in 1/gain
DIVERGENCE = 100.0  # a run diverges when its error or depth exceeds that of its start so many times
