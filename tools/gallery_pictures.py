"""Small pictures of a run, as data URLs that contain the PNG."""

import base64
from io import BytesIO
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from PIL import Image, ImageChops

import robsim as rs

SIZE = (320, 240)  # pixels, twice the size on the page
DPI = 120  # of the drawing, before it is made smaller
COLORS = 32  # enough for the solids of an arm, and few enough for some kB
AROUND = 0.2  # metres around the frames of a robot far smaller than its scene


def pictures(experiment: rs.Experiment, run: Any) -> list[str]:
    """Return pictures of the scene, and of the image of the first camera unless of a mission."""
    if isinstance(run, rs.tasks.MissionRun):
        return [_of_mission(run)]
    figures = rs.plot.scene(experiment.scene, run=run), rs.plot.image(run)
    return [_small(figure) for figure in figures]


def _of_mission(run: rs.tasks.MissionRun) -> str:
    """Return a picture at the end of the phase in the middle, near the robot."""
    leg = run.legs[len(run.legs) // 2]
    (robot,) = leg.scene.robots
    moving = robot.frames(leg.q_end)[1:, :3, 3] @ leg.scene.display.matrix[:3, :3].T
    bounds = np.array([moving.min(axis=0) - AROUND, moving.max(axis=0) + AROUND])
    return _small(rs.plot.scene(leg.scene, leg.q_end, bounds=bounds))


def _small(figure: Figure) -> str:
    """Return the drawing without texts, which are unreadable at this size."""
    for axes in figure.axes:
        axes.set_axis_off()
        axes.set_title("")
        for artist in axes.get_children():
            artist.set_clip_on(False)  # parts outside the box of the axes are drawn, too
    for legend in [*figure.legends, *(axes.get_legend() for axes in figure.axes)]:
        if legend is not None:
            legend.remove()
    drawn, small = BytesIO(), BytesIO()
    figure.savefig(drawn, format="png", dpi=DPI)
    _fitted(Image.open(drawn).convert("RGB")).quantize(COLORS).save(small, "PNG", optimize=True)
    return f"data:image/png;base64,{base64.b64encode(small.getvalue()).decode()}"


def _fitted(image: Image.Image) -> Image.Image:
    """Return the part that is not white, centred in a picture of SIZE."""
    paper = Image.new("RGB", image.size, "white")
    drawn = image.crop(ImageChops.difference(image, paper).getbbox())
    drawn.thumbnail((SIZE[0] - 8, SIZE[1] - 8))
    page = Image.new("RGB", SIZE, "white")
    page.paste(drawn, ((SIZE[0] - drawn.width) // 2, (SIZE[1] - drawn.height) // 2))
    return page
