"""Pictures of a run in a given size: its scene, and the image of its first camera."""

from io import BytesIO
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from PIL import Image, ImageChops

import robsim as rs

DPI = 120  # of the figure, before it is scaled down
MARGIN = 0.2  # metres around the frames of the robot, if its scene is far larger


def draw_scene_and_image(
    experiment: rs.Experiment, run: Any, scene: tuple[int, int], image: tuple[int, int]
) -> Image.Image:
    """Return the scene beside the image, both in given sizes; of a mission the scene alone."""
    size = (scene[0] + image[0], scene[1])
    if isinstance(run, rs.tasks.MissionRun):
        return draw_scene(experiment, run, size)
    picture = Image.new("RGB", size, "white")
    picture.paste(draw_scene(experiment, run, scene), (0, 0))
    picture.paste(draw_image(run, image), (scene[0], 0))
    return picture


def draw_image(run: Any, size: tuple[int, int]) -> Image.Image:
    """Return a picture of the image of the first camera, with the paths of the feature points."""
    return _draw_figure(rs.plot.image(run), size)


def draw_scene(experiment: rs.Experiment, run: Any, size: tuple[int, int]) -> Image.Image:
    """Return a picture of the scene with the paths of a run; of a mission, its middle phase."""
    if isinstance(run, rs.tasks.MissionRun):
        return _draw_figure(_plot_mission(run), size)
    return _draw_figure(rs.plot.scene(experiment.scene, run=run), size)


def _plot_mission(run: rs.tasks.MissionRun) -> Figure:
    """Return a figure of the robot at the end of the middle phase of a mission."""
    leg = run.legs[len(run.legs) // 2]
    (robot,) = leg.scene.robots
    moving = robot.frames(leg.q_end)[1:, :3, 3] @ leg.scene.display.matrix[:3, :3].T
    bounds = np.array([moving.min(axis=0) - MARGIN, moving.max(axis=0) + MARGIN])
    return rs.plot.scene(leg.scene, leg.q_end, bounds=bounds)


def _draw_figure(figure: Figure, size: tuple[int, int]) -> Image.Image:
    """Return a figure as a small picture, without texts, which would be unreadable."""
    for axes in figure.axes:
        axes.set_axis_off()
        axes.set_title("")
        for artist in axes.get_children():
            artist.set_clip_on(False)  # parts outside the box of the axes are drawn, too
    for legend in [*figure.legends, *(axes.get_legend() for axes in figure.axes)]:
        if legend is not None:
            legend.remove()
    png = BytesIO()
    figure.savefig(png, format="png", dpi=DPI)
    return _crop_to_content(Image.open(png).convert("RGB"), size)


def _crop_to_content(image: Image.Image, size: tuple[int, int]) -> Image.Image:
    """Return the part of an image that is not white, centred in a picture of a size."""
    paper = Image.new("RGB", image.size, "white")
    content = image.crop(ImageChops.difference(image, paper).getbbox())
    content.thumbnail((size[0] - 8, size[1] - 8))
    page = Image.new("RGB", size, "white")
    page.paste(content, ((size[0] - content.width) // 2, (size[1] - content.height) // 2))
    return page
