"""Direct visual servoing: basins of features of whole pictures on twelve posters.

Published comparisons use a few pictures each, and none compares all features. Chosen here: twelve
procedural pictures of three kinds, posters of 2.4 m x 1.8 m a metre before a camera of 80 x 60
pixels with a field of view of 53 degrees, and starts in five sizes of displacement. A start of the
size d is translated by d in a random direction, and turned by 0.8 degrees for each centimetre about
a random axis. The runs of one picture are one draw, so that intervals account for few pictures.
"""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pandas as pd

from robsim.base.arrays import Array
from robsim.features.images.cosine_coefficients import CosineCoefficients
from robsim.features.images.defocus import Defocus
from robsim.features.images.dense_feature import DenseFeature
from robsim.features.images.histogram import Histogram
from robsim.features.images.linear_feature import LinearFeature
from robsim.features.images.luminance import Luminance
from robsim.features.images.mutual_information import MutualInformation
from robsim.features.images.photometric_mixture import PhotometricMixture
from robsim.features.images.photometric_moments import PhotometricMoments
from robsim.features.images.principal_components import PrincipalComponents
from robsim.files import robots
from robsim.geometry.pose import Pose
from robsim.geometry.primitives import Poster
from robsim.rendering.light import Light
from robsim.servo.tasks.schemes import IBVS
from robsim.statistics.random_numbers import SUITES, uniform
from robsim.suites.camera_poses import directions_in_cap
from robsim.suites.procedural_pictures import KINDS, draw_procedural_picture
from robsim.suites.suite import Suite, square_marks
from robsim.vision.camera import Camera
from robsim.world.mounted_camera import MountedCamera
from robsim.world.object import Object
from robsim.world.scene import Scene

PICTURES = [(kind, seed) for seed in range(4) for kind in KINDS]
SIZES = 0.05, 0.1, 0.2, 0.3, 0.4  # metres
STARTS, SEED = 8, 5  # of each size and picture
TURN = np.radians(80.0)  # for each metre
WIDTH, SPACING, DISTANCE = 2.4, 6.0, 1.0  # of a poster, between posters, to the goal, metres
FEATURES: dict[str, DenseFeature | LinearFeature] = {
    "luminance": Luminance(border=4),
    "mixture": PhotometricMixture(border=4, extension=8.0),
    "defocus": Defocus(border=4, focal_length=0.02, f_number=0.95, focus=0.5, pixel=2e-5),
    "histogram": Histogram(border=4),
    "information": MutualInformation(border=4),
    "moments": PhotometricMoments(),
    "components": PrincipalComponents(),
    "cosines": CosineCoefficients(),
}


def suite() -> Suite:
    """Return the suite."""
    cases = np.array(list(product(range(len(PICTURES)), range(len(SIZES)), range(STARTS))))
    picture, size = cases[:, 0], np.array(SIZES)[cases[:, 1]]
    goal, aside = Pose.at(0, 0, -DISTANCE), np.array([SPACING, 0.0, 0.0])
    marks = square_marks(0.6)
    return Suite(
        "photometric",
        1,
        "features of whole pictures before twelve posters",
        "RobSim; schemes: Collewet and Marchand 2011, Crombez et al. 2019, Caron 2021, Bateux and "
        "Marchand 2017, Dame and Marchand 2011, Bakthavatchalam et al. 2018, Marchand 2019, 2020",
        "at the end within 1 cm and 1 degree of the goal",
        is_at_goal,
        build_gallery(),
        goal.q,
        (goal @ _sample_displacements(size)).q,
        gain=5.0,
        dt=0.04,
        duration=8.0,
        varied={
            "objects.wall.position": -picture[:, None] * aside,
            "objects.wall.marks": marks + (picture[:, None] * aside)[:, None, :],
        },
        groups={"displacement": [f"{100 * each:g} cm" for each in size]},
        draws=picture,
        schemes=list_schemes(),
    )


def list_schemes() -> dict[str, IBVS]:
    """Return a scheme for each feature with L current, and the luminance with other L."""
    luminance = FEATURES["luminance"]
    schemes = {name: IBVS(features=each) for name, each in FEATURES.items()}
    for model in ("desired", "mean"):
        schemes[f"luminance, L {model}"] = IBVS(features=luminance, interaction=model)
    return schemes


def is_at_goal(rows: pd.DataFrame) -> Any:
    """Return which runs end at the goal, one truth value for each row."""
    angle = rows["angle_to_goal"]
    return (rows["distance_to_goal"] < 0.01) & (angle < np.radians(1.0))


def build_gallery() -> Scene:
    """Return a flying camera, and a wall with all posters side by side along x."""
    K = [[80.0, 0.0, 39.5], [0.0, 80.0, 29.5], [0.0, 0.0, 1.0]]
    eye = MountedCamera("eye", Camera(K, size=(80, 60)), on="free_camera.body")
    posters = tuple(
        Poster(draw_procedural_picture(*each), WIDTH, pose=Pose.at(SPACING * k, 0, 0))
        for k, each in enumerate(PICTURES)
    )
    wall = Object("wall", shapes=posters, marks=square_marks(0.6))
    return Scene((robots.load("free_camera"),), (wall,), (eye,), light=Light(ambient=1.0))


def _sample_displacements(size: Array) -> Pose:
    """Return displacements of the camera (runs,), in its own axes at the goal."""
    u = uniform(SEED, SUITES, len(size), 4)
    shifts = size[:, None] * directions_in_cap(u[:, :2], np.pi)
    rotations = TURN * size[:, None] * directions_in_cap(u[:, 2:], np.pi)
    return Pose.at(*shifts.T, rotvec=rotations)
