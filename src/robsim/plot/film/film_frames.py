"""The frames of a film: the background is drawn once, the animated artists for each frame."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from textwrap import shorten
from typing import Any, cast

import numpy as np
from matplotlib.artist import Artist
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from robsim.base.errors import InputError
from robsim.plot.canvas import UnmanagedFigure, figure_style
from robsim.plot.film.film_curves import FilmCurves
from robsim.plot.film.film_images import FilmImage, list_film_cameras
from robsim.plot.film.film_scene import FilmScene
from robsim.plot.film.film_source import FilmSource
from robsim.plot.film.frame_times import FrameTimes
from robsim.plot.run_figure import HEIGHT, split_slide

Frame = NDArray[np.uint8]  # (height, width, 4): red, green, blue, and full opacity
MOST_LETTERS = 90  # in a title


class FilmFrames:
    """The frames of a film as a sequence of images with the same axes."""

    def __init__(
        self,
        source: FilmSource,
        clock: FrameTimes,
        size: tuple[float, float],
        dpi: float,
        **look: Any,
    ) -> None:
        self.source, self.clock = source, clock
        names = list_film_cameras(source)
        self._scene = FilmScene(source, clock.instants, look["view"], look["goal"])
        self._images = [FilmImage(source, name, len(names) == 1) for name in names]
        self._curves = FilmCurves(source)
        with figure_style():
            self.figure = UnmanagedFigure(size, dpi=dpi, layout="constrained")
            self._canvas = cast("Any", FigureCanvasAgg(self.figure))  # its methods have no types
            self._animated = self._draw_first_frame(look["title"])
            self._canvas.draw()
            self._still = self._canvas.copy_from_bbox(self.figure.bbox)

    def __len__(self) -> int:
        return len(self.clock.instants)

    def __getitem__(self, k: int) -> Frame:
        instant = int(self.clock.instants[k])
        self._scene.place(k)
        for image in self._images:
            image.place(instant)
        self._curves.place(instant)
        self._caption.set_text(self._format_caption(instant))
        with figure_style():
            self._canvas.restore_region(self._still)
            for artist in self._animated:
                if hasattr(artist, "do_3d_projection"):
                    artist.do_3d_projection()
                artist.draw(self._canvas.get_renderer())
        return np.array(self._canvas.buffer_rgba())

    def _draw_first_frame(self, title: str | None) -> list[Artist]:
        """Draw the first frame, and return the animated artists in drawing order."""
        upper, below = split_slide(
            self.figure, self._scene.measure_width(HEIGHT), bool(self._images)
        )
        groups: list[Sequence[Artist]] = [self._scene.draw(upper[0])]
        if self._images:
            panels = np.ravel(upper[1].subplots(1, len(self._images)))
            pairs = zip(self._images, panels, strict=True)
            groups += [image.draw(axes) for image, axes in pairs]
        groups.append(self._curves.draw(list(np.ravel(below.subplots(1, self._curves.panels)))))
        text = self.source.title if title is None else title
        self.figure.suptitle(
            shorten(text, MOST_LETTERS, placeholder=" …") or " ", x=0.01, ha="left"
        )
        self._caption = self.figure.text(0.99, 0.99, " ", ha="right", va="top")
        _lay_out_figure(self.figure)  # computes the size of every part
        self._scene.arrange(upper[0])
        self.figure.set_layout_engine("none")
        groups.append([self._caption])
        ordered = [each for group in groups for each in sorted(group, key=Artist.get_zorder)]
        for artist in ordered:
            artist.set_animated(True)
        return ordered

    def _format_caption(self, instant: int) -> str:
        """Return the caption of an instant: phase or ending, speed and time."""
        source, speed = self.source, self.clock.speed
        last = instant == len(source.time) - 1
        phases = (shot.name for shot in source.shots if instant in shot.instants)
        name = source.ending if last else next(phases)
        fast = "" if speed == 1 else f"×{speed:.3g}"
        return "     ".join(filter(None, [name, fast, f"t = {source.time[instant]:.2f} s"]))


def _lay_out_figure(figure: Figure) -> None:
    """Lay out the figure; raise InputError if a part has too little space."""
    with warnings.catch_warnings():
        warnings.filterwarnings("error", "constrained_layout not applied")
        try:
            figure.draw_without_rendering()
        except UserWarning:
            raise InputError(
                "size: {:g} x {:g} inches are too few for all parts of the film; "
                "reduce dpi instead to get fewer pixels".format(*figure.get_size_inches())
            ) from None
