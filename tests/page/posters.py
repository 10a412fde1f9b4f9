"""Runs in front of a poster, and the pictures in their recordings."""

import base64
import dataclasses
import io

import numpy as np

import robsim as rs


def hang_poster(grey, optics=None, **changes):
    """ViSP's tutorial case with a poster behind its square."""
    experiment = rs.load_scenario(rs.examples.path("visp_tutorial"))
    (square,) = experiment.scene.objects
    poster = dataclasses.replace(square, shapes=(rs.shapes.Poster(grey, 0.6),), marks=square.marks)
    eye = dataclasses.replace(experiment.scene.camera(), optics=optics)
    return experiment.with_(scene=experiment.scene.replacing(poster, eye), **changes)


def draw_noise(shape=(60, 80), seed=0):
    return np.random.default_rng(seed).integers(0, 256, shape, dtype=np.uint8)


def decode(address):
    """The grey values in a data URL of a PNG file."""
    from PIL import Image

    head, data = address.split(",")
    assert head == "data:image/png;base64"
    with Image.open(io.BytesIO(base64.b64decode(data)), formats=["PNG"]) as image:
        assert image.mode == "L"
        return np.asarray(image)


def read_pictures(recording, camera="camera"):
    (entry,) = [each for each in recording.header["cameras"] if each["name"] == camera]
    return entry.get("pictures")
