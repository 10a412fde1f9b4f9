"""One camera looking at one object on the tree: everything that follows from q at an instant."""

from robsim.kernels import camera, tree
from robsim.kernels.jit import kernel


@kernel
def look(
    parent,
    kind,
    iq,
    place,
    q,
    eye,
    hand_eye,
    target,
    offset,
    marks,
    K,
    lens,
    border,
    reach,
    M,
    T_w_c,
    T_w_o,
    X,
    Z,
    pixels,
    status,
):
    """Bodies M, poses of camera and target, the marks in camera axes, depths, pixels, visibility.

    `eye` and `target` are bodies, at which camera and target ride at `hand_eye` and `offset`.
    """
    tree.bodies(parent, kind, iq, place, q, M)
    tree.frame(M, eye, hand_eye, T_w_c)
    tree.frame(M, target, offset, T_w_o)
    camera.into_camera(T_w_c, T_w_o, marks, X)
    camera.project(X, K, lens, pixels)
    camera.visibility(X, pixels, border, reach, status)
    for n in range(Z.shape[0]):
        for b in range(Z.shape[1]):
            Z[n, b] = X[n, 2, b]
