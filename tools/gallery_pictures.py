"""Small pictures of a run, as data URLs that contain the PNG."""

import base64
from io import BytesIO
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from PIL import Image, ImageChops

import robsim as rs

SIZE = (320, 240)  # pixels, twice the size on the page
DPI = 120  # of the figure, before it is scaled down
COLORS = 32  # enough for the solids of an arm, and few enough for some kB
MARGIN = 0.2  # metres around the frames of the robot, if its scene is far larger


def pictures(experiment: rs.Experiment, run: Any) -> list[str]:
    """Return pictures of the scene and of the first camera's image; of a mission only the scene."""
    if isinstance(run, rs.tasks.MissionRun):
        return [_draw_mission(run)]
    figures = rs.plot.scene(experiment.scene, run=run), rs.plot.image(run)
    return [_encode_figure(figure) for figure in figures]


def _draw_mission(run: rs.tasks.MissionRun) -> str:
    """Return a picture of the robot at the end of the middle phase of a mission."""
    leg = run.legs[len(run.legs) // 2]
    (robot,) = leg.scene.robots
    moving = robot.frames(leg.q_end)[1:, :3, 3] @ leg.scene.display.matrix[:3, :3].T
    bounds = np.array([moving.min(axis=0) - MARGIN, moving.max(axis=0) + MARGIN])
    return _encode_figure(rs.plot.scene(leg.scene, leg.q_end, bounds=bounds))


def _encode_figure(figure: Figure) -> str:
    """Return a figure as a small picture, without texts, which would be unreadable."""
    for axes in figure.axes:
        axes.set_axis_off()
        axes.set_title("")
        for artist in axes.get_children():
            artist.set_clip_on(False)  # parts outside the box of the axes are drawn, too
    for legend in [*figure.legends, *(axes.get_legend() for axes in figure.axes)]:
        if legend is not None:
            legend.remove()
    png, small = BytesIO(), BytesIO()
    figure.savefig(png, format="png", dpi=DPI)
    _crop_to_content(Image.open(png).convert("RGB")).quantize(COLORS).save(
        small, "PNG", optimize=True
    )
    return f"data:image/png;base64,{base64.b64encode(small.getvalue()).decode()}"


def _crop_to_content(image: Image.Image) -> Image.Image:
    """Return the part of an image that is not white, centred in a picture of SIZE."""
    paper = Image.new("RGB", image.size, "white")
    content = image.crop(ImageChops.difference(image, paper).getbbox())
    content.thumbnail((SIZE[0] - 8, SIZE[1] - 8))
    page = Image.new("RGB", SIZE, "white")
    page.paste(content, ((SIZE[0] - content.width) // 2, (SIZE[1] - content.height) // 2))
    return page
