"""The pose of a target in the camera, fitted to the image of its marks."""

from robsim.kernels.jit import kernel


@kernel
def fit_pose(marks, x, guess, T):
    """T[3, 4, b]: the pose that puts marks (N, 3) at normalised x[n, 2, b], from guess[3, 4, b]."""
    raise NotImplementedError
