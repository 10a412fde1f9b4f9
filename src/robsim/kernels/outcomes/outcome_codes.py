"""The outcome codes of a run, and the thresholds of the rules that determine the outcome."""

RUNNING, CONVERGED, LOCAL_MINIMUM, OUT_OF_IMAGE, BEHIND_CAMERA = 0, 1, 2, 3, 4
JOINT_LIMIT, SINGULAR, DIVERGED, NOT_FINITE, TIME_LIMIT, ENDED, UNDETECTED = 5, 6, 7, 8, 9, 10, 11
NO_GRADIENT, NOTHING_IN_VIEW, UNSTABLE = 12, 13, 14
LAST = UNSTABLE
STALL_PERIODS = 10
STALL = 0.01  # share of the tolerance; in 1/gain a converging run removes about its whole error
DIVERGENCE = 100.0  # a run diverges if its error or depth exceeds the initial value by this factor
