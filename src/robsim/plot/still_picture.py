"""Still pictures as PNG of at most 22 kB, for places that cannot show a page."""

from __future__ import annotations

import warnings
from io import BytesIO
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import ArrayLike
from PIL import Image

from robsim.base.errors import FileWarning
from robsim.plot import axes_box
from robsim.plot.canvas import UnmanagedFigure, figure_style
from robsim.plot.image_figure import draw_image
from robsim.plot.run_data import extract_single_run
from robsim.plot.scene_content import build_scene_content
from robsim.plot.scene_figure import arrange_scene, draw_scene
from robsim.plot.studies.basin_figure import study_basin
from robsim.plot.studies.distributions_figure import study_distributions

if TYPE_CHECKING:
    import xarray as xr

    from robsim.studies.study_result import StudyResult
    from robsim.world.scene import Scene

DPI = 80
HEIGHT, SCENE, IMAGE = 4.0, 5.2, 4.0  # inches: height, and widths of the scene and the image
MOST_BYTES = 22_000  # of a picture
COLORS = (255, 128, 64, 32, 16)  # numbers of colours, fewer for pictures that are too large


def draw_scene_still(
    scene: Scene, q: ArrayLike | None = None, run: xr.Dataset | None = None
) -> bytes:
    """Return a picture of a scene at q (nq,) or over a run, with the image of the first camera."""
    with warnings.catch_warnings(), figure_style():
        warnings.simplefilter("ignore", FileWarning)  # the page warns of missing meshes
        figures = [_draw_scene_part(scene, q, run)]
        if run is not None and "pixels" in run and run.sizes.get("mark", 0):
            figures.append(_draw_image_part(scene, run))
    return encode_figures(*figures)


def draw_study_still(study: StudyResult) -> bytes:
    """Return a picture of the starts of a study, or of the distributions of its measures."""
    size = (SCENE + IMAGE, HEIGHT)
    placed = {"start_x", "start_y"} <= set(study.table.columns)
    figure = study_basin(study, size=size) if placed else study_distributions(study, size=size)
    plt.close(figure)  # an interactive backend would show it
    return encode_figures(figure)


def encode_figures(*figures: Figure) -> bytes:
    """Return figures of equal height side by side, as PNG with a palette of colours."""
    images = [_render_figure(figure) for figure in figures]
    picture = Image.new("RGB", (sum(image.width for image in images), images[0].height), "white")
    left = 0
    for image in images:
        picture.paste(image, (left, 0))
        left += image.width
    data = b""
    for count in COLORS:
        stream = BytesIO()
        picture.quantize(count, dither=Image.Dither.NONE).save(stream, "png", optimize=True)
        data = stream.getvalue()
        if len(data) <= MOST_BYTES:
            break
    return data


def _draw_scene_part(scene: Scene, q: ArrayLike | None, run: xr.Dataset | None) -> Figure:
    """Return a figure of the scene."""
    figure = UnmanagedFigure((SCENE, HEIGHT), dpi=DPI, layout=None)
    content = build_scene_content(scene, q, run)
    box = axes_box.compute_axes_box(content.points)
    arrange_scene(figure, draw_scene(figure, content, box, None).axes, content, box)
    return figure


def _draw_image_part(scene: Scene, run: xr.Dataset) -> Figure:
    """Return a figure of the image of the first camera."""
    figure = UnmanagedFigure((IMAGE, HEIGHT), dpi=DPI, layout="constrained")
    draw_image(figure.subplots(), extract_single_run(run), None, scene, None)
    return figure


def _render_figure(figure: Figure) -> Image.Image:
    """Return the pixels of a figure, at the resolution of a still picture."""
    figure.set_dpi(DPI)
    canvas: Any = FigureCanvasAgg(figure)
    canvas.draw()
    return Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")
