"""A summary figure of a run: the scene, the image, the velocities and the error."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from matplotlib.figure import Figure

from robsim.plot import history, space
from robsim.plot.canvas import new_figure, style
from robsim.plot.image import draw as draw_image
from robsim.plot.picture import picture_of
from robsim.plot.scene import arrange, width_of
from robsim.plot.scene import draw as draw_scene
from robsim.plot.velocity import draw as draw_velocity

if TYPE_CHECKING:
    import xarray as xr

    from robsim.world.scene import Scene

HEIGHT = 4.4  # inches, of the upper row


def run(
    run: xr.Dataset,
    scene: Scene,
    camera: str | None = None,
    frame: str | None = None,
    *,
    goal: Any = None,
    view: Any = None,
    size: Any = None,
    title: str | None = None,
) -> Figure:
    """Draw a run on one slide: `scene`, `image` and `velocity` together.

    `camera` selects the image and `frame` the velocity, as in `image` and `velocity`; `goal`
    and `view` are as in `scene`, and `size` is (width, height) in inches. Without a camera there is
    no image.

    >>> from robsim import IBVS, Camera, Joint, Link, MountedCamera, Object, Pose, Robot, Scene
    >>> from robsim.run.simulate import simulate
    >>> fly = Robot("fly", [Link("base"), Link("body", "base", Joint("floating"))])
    >>> square = Object("square", marks=[[0, 0, 1], [0.1, 0, 1], [0.1, 0.1, 1], [0, 0.1, 1]])
    >>> camera = Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]], size=(640, 480))
    >>> there = Scene(fly, square, MountedCamera("eye", camera, "fly.body"))
    >>> len(run(simulate(there, IBVS(), Pose.at(0.1, 0, -0.2), duration=1.0), there).axes)
    5
    """
    one = history.single(run)
    with style():
        figure = new_figure(12.8, 7.2, size)
        drawn = bool(one.sizes["mark"]) or camera is not None
        picture = picture_of(scene, None, one, goal)
        box = space.box(picture.points)
        places, below = split(figure, width_of(picture, HEIGHT, view, box), drawn)
        solid = draw_scene(places[0], picture, box, view).axes
        if drawn:
            draw_image(places[1].add_subplot(), one, camera, scene, title="")
        draw_velocity(below.subplots(1, 3), one, scene, frame)
        heading = f"{history.ending(one)}; path {float(one['path_length']):.3g} m"
        figure.suptitle(heading if title is None else title)
        figure.draw_without_rendering()  # now every part has its size
        arrange(places[0], solid, picture, box)
    return figure


def split(figure: Figure, width: float, images: bool) -> tuple[list[Any], Any]:
    """Return the parts of a slide: of a scene, `width` inches wide, and of images; of curves."""
    rows: Any = figure.subfigures(2, 1, height_ratios=(1.9, 1))
    share = min(max(width / float(figure.get_figwidth()), 0.35), 0.6)
    above = rows[0].subfigures(1, 2, width_ratios=(share, 1 - share)) if images else [rows[0]]
    return list(above), rows[1]
