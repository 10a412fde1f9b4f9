"""The outcomes of a run."""

from __future__ import annotations

from robsim.base.named_integers import NamedInteger
from robsim.kernels.outcomes import outcome_codes


class Outcome(NamedInteger):
    """The reason for the end of a run.

    `message` explains the outcome and suggests remedies. A run ends if any camera of the task loses
    any mark of its target, even a mark that no feature uses. With a weighting that lets marks leave
    the image (`Border`), it ends as OUT_OF_IMAGE if too few marks are left to compute a command.

    Attributes
    ----------
    RUNNING
        The run was interrupted before its end.
    CONVERGED
        Every feature error is below the tolerance.
    LOCAL_MINIMUM
        The command is zero although an error remains.
    OUT_OF_IMAGE
        A mark left the image.
    BEHIND_CAMERA
        A mark moved behind the camera.
    JOINT_LIMIT
        A joint left its limits.
    SINGULAR
        The command is zero, and L J has a lower rank than at the goal.
    DIVERGED
        The error or a depth grew a hundredfold.
    NOT_FINITE
        A state, a feature or a command is not finite.
    TIME_LIMIT
        The duration ended.
    ENDED
        An ending of the experiment holds.
    UNDETECTED
        The detector of the task does not find every mark in the first picture.
    NO_GRADIENT
        The picture has no gradient, so that no motion changes it.
    NOTHING_IN_VIEW
        The picture has hardly any contrast: the scene of the goal has left it.
    UNSTABLE
        The speed of a joint with a drive exceeds 1000 rad/s or m/s.

    Notes
    -----
    If several conditions hold at one instant, the first of this order counts: UNSTABLE, NOT_FINITE
    of the state, JOINT_LIMIT, BEHIND_CAMERA, OUT_OF_IMAGE, UNDETECTED, NOTHING_IN_VIEW,
    NO_GRADIENT, NOT_FINITE of a feature, CONVERGED, DIVERGED, NOT_FINITE of the command, SINGULAR,
    LOCAL_MINIMUM, ENDED, TIME_LIMIT.

    Examples
    --------
    >>> Outcome.CONVERGED.message
    'converged: every feature error is below the tolerance'
    >>> Outcome.LOCAL_MINIMUM.words
    'local minimum'
    """

    RUNNING = outcome_codes.RUNNING
    CONVERGED = outcome_codes.CONVERGED
    LOCAL_MINIMUM = outcome_codes.LOCAL_MINIMUM
    OUT_OF_IMAGE = outcome_codes.OUT_OF_IMAGE
    BEHIND_CAMERA = outcome_codes.BEHIND_CAMERA
    JOINT_LIMIT = outcome_codes.JOINT_LIMIT
    SINGULAR = outcome_codes.SINGULAR
    DIVERGED = outcome_codes.DIVERGED
    NOT_FINITE = outcome_codes.NOT_FINITE
    TIME_LIMIT = outcome_codes.TIME_LIMIT
    ENDED = outcome_codes.ENDED
    UNDETECTED = outcome_codes.UNDETECTED
    NO_GRADIENT = outcome_codes.NO_GRADIENT
    NOTHING_IN_VIEW = outcome_codes.NOTHING_IN_VIEW
    UNSTABLE = outcome_codes.UNSTABLE

    @property
    def words(self) -> str:
        """The name in lower case with spaces, such as "local minimum"."""
        return self.name.lower().replace("_", " ")

    @property
    def message(self) -> str:
        """The meaning of the outcome and the suggested remedies, as one sentence."""
        return f"{self.words}: {_MESSAGES[self]}"


_MESSAGES = {
    Outcome.RUNNING: "the simulation was stopped before this run ended",
    Outcome.CONVERGED: "every feature error is below the tolerance",
    Outcome.LOCAL_MINIMUM: (
        "no motion is commanded although the error remains; try L desired or mean, "
        "the other law, or a nearer start; on a path, a goal that the joints can reach, or its "
        "position alone"
    ),
    Outcome.OUT_OF_IMAGE: (
        "a mark left the image, or too few are left of those that may; try a lower gain, a larger "
        "image, L mean, or a nearer start"
    ),
    Outcome.BEHIND_CAMERA: "a mark came behind the camera; try L mean or a nearer start",
    Outcome.JOINT_LIMIT: "a joint left its limits; try another start or goal",
    Outcome.SINGULAR: (
        "the law commands no motion because L J lost rank here (singular values below rcond count "
        "as zero); try a damped inverse, a smaller rcond, other features, or a goal within reach"
    ),
    Outcome.DIVERGED: "the error or the depth grew a hundredfold; try a lower gain or another L",
    Outcome.NOT_FINITE: "a number is not finite: a feature, a law or a state overflowed",
    Outcome.TIME_LIMIT: (
        "the time was over before the error was small; try a longer duration, or a larger "
        "tolerance where there is noise"
    ),
    Outcome.ENDED: "an ending of the experiment holds; see `ending` of the run",
    Outcome.UNDETECTED: (
        "the detector does not find a mark in the first picture; try a nearer start, a larger "
        "image, better optics, or another detector"
    ),
    Outcome.NO_GRADIENT: (
        "the picture has no gradient, so that no motion of the camera changes it; try a target "
        "with texture, a sharper picture, or another exposure"
    ),
    Outcome.NOTHING_IN_VIEW: (
        "the picture has hardly any contrast: the scene of the goal has left it; try a nearer "
        "start, a wider field of view, or a lower gain"
    ),
    Outcome.UNSTABLE: (
        "the speed of a joint exploded; try a lower gain of the task or of the drive, or a shorter "
        "step of the dynamics"
    ),
}
