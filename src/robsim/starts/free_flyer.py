"""Frames that a single floating joint carries, and the coordinates that bring them to poses."""

from __future__ import annotations

import numpy as np

from robsim.base.arrays import Array
from robsim.geometry.pose import Pose, homogeneous
from robsim.servo.controller import Controller
from robsim.world.scene import Scene


def flies(controller: Controller, frame: str) -> bool:
    """Return whether all that a task commands is one floating joint on the world with the frame."""
    tree = controller.scene.tree
    body, _ = tree.find(frame)
    free = tree.models[body].free and tree.parent[body] == 0
    return bool(free and (tree.owners[controller.columns] == body).all())


def flown(scene: Scene, frame: str, T: Array) -> Array:
    """Return coordinates (n, nq) that bring a frame that flies to poses (n, 4, 4) in the world.

    The other coordinates stay at home.
    """
    tree = scene.tree
    body, T_b_f = tree.find(frame)
    place = Pose(homogeneous(tree.joints.place[body][..., None])[0])
    q = np.tile(scene.home, (len(T), 1))
    first = tree.joints.bodies[body].x
    q[:, first : first + 7] = (place.inv() @ Pose(T) @ Pose(T_b_f).inv()).q
    return q
