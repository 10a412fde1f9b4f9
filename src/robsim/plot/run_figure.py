"""A summary figure of a run: the scene, the image, the velocities and the error."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from matplotlib.figure import Figure

from robsim.plot import axes_box, run_data
from robsim.plot.canvas import figure_style, new_figure
from robsim.plot.image_figure import draw_image as draw_image
from robsim.plot.scene_content import build_scene_content
from robsim.plot.scene_figure import arrange_scene, measure_scene_width
from robsim.plot.scene_figure import draw_scene as draw_scene
from robsim.plot.velocity_figure import draw_velocity as draw_velocity

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

    >>> from robsim import IBVS, Camera, MountedCamera, Object, Pose, Robot, Scene
    >>> from robsim.joints import Joint, Link
    >>> from robsim.run.simulate import simulate
    >>> fly = Robot("fly", [Link("base"), Link("body", "base", Joint("floating"))])
    >>> square = Object("square", marks=[[0, 0, 1], [0.1, 0, 1], [0.1, 0.1, 1], [0, 0.1, 1]])
    >>> camera = Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]], size=(640, 480))
    >>> there = Scene(fly, square, MountedCamera("eye", camera, "fly.body"))
    >>> len(run(simulate(there, IBVS(), Pose.at(0.1, 0, -0.2), duration=1.0), there).axes)
    5
    """
    one = run_data.extract_single_run(run)
    with figure_style():
        figure = new_figure(12.8, 7.2, size)
        drawn = bool(one.sizes["mark"]) or camera is not None
        picture = build_scene_content(scene, None, one, goal)
        box = axes_box.compute_axes_box(picture.points)
        places, below = split_slide(figure, measure_scene_width(picture, HEIGHT, view, box), drawn)
        solid = draw_scene(places[0], picture, box, view).axes
        if drawn:
            draw_image(places[1].add_subplot(), one, camera, scene, title="")
        draw_velocity(below.subplots(1, 3), one, scene, frame)
        heading = f"{run_data.describe_ending(one)}; path {float(one['path_length']):.3g} m"
        figure.suptitle(heading if title is None else title)
        figure.draw_without_rendering()  # now every part has its size
        arrange_scene(places[0], solid, picture, box)
    return figure


def split_slide(figure: Figure, width: float, images: bool) -> tuple[list[Any], Any]:
    """Return the parts of a slide: of a scene, `width` inches wide, and of images; of curves."""
    rows: Any = figure.subfigures(2, 1, height_ratios=(1.9, 1))
    share = min(max(width / float(figure.get_figwidth()), 0.35), 0.6)
    above = rows[0].subfigures(1, 2, width_ratios=(share, 1 - share)) if images else [rows[0]]
    return list(above), rows[1]
