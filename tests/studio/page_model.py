"""A page without a browser: the header and the arrays that it has after some messages."""

from __future__ import annotations

import base64
import json

import numpy as np

from robsim.page.recording_codec import unpack_recording

SHAPES = ("triangles", "edges", "points", "frustum")


class PageModel:
    """Applies messages as the script of the page does."""

    def __init__(self, messages=()):
        self.header, self.arrays, self.shapes, self.kinds = {}, {}, {}, []
        self.sizes = []
        self.hear(messages)

    def hear(self, messages):
        """Apply messages; return their types."""
        told = list(messages)
        self.sizes += map(len, told)
        kinds = [self._apply(json.loads(each)) for each in told]
        self.kinds += kinds
        return kinds

    def _apply(self, message):
        kind = message["type"]
        if kind in ("shapes", "recording", "rows"):
            header, arrays = unpack_recording(base64.b64decode(message["recording"]))
            getattr(self, f"_take_{kind}")(message, header, arrays)
        elif kind == "entries":
            self._amend(message["header"])
        return kind

    def _take_shapes(self, message, header, arrays):
        for name, start in header["starts"].items():
            before = self.shapes[name][:start] if start else arrays[name][:0]
            self.shapes[name] = np.concatenate([before, arrays[name]])

    def _take_recording(self, message, header, arrays):
        self.header, self.arrays = header, arrays
        self._keep_shapes()

    def _take_rows(self, message, header, arrays):
        start, width = message["from"], len(self.header["frames"])
        for name, values in arrays.items():
            own, more = self.arrays[name], values
            if name == "poses":
                own, more = _widen(own, width), _widen(more, width)
            whole = name.endswith(".goal")
            self.arrays[name] = more if whole else np.concatenate([own[:start], more])

    def _amend(self, changes):
        for key, change in changes.items():
            if "length" not in change:
                self.header[key] = change["value"]
                continue
            entries = self.header[key][: change["length"]]
            entries += [None] * (change["length"] - len(entries))
            for index, entry in change["changed"]:
                entries[index] = entry
            self.header[key] = entries
        self._keep_shapes()

    def _keep_shapes(self):
        entries = [x for kind in ("parts", "marks", "cameras") for x in self.header[kind]]
        names = {each[key] for each in entries for key in SHAPES if key in each}
        self.shapes = {name: self.shapes[name] for name in names}

    def groups(self):
        """The groups of the frames with parts."""
        frames = self.header["frames"]
        return {frames[part["frame"]]["group"] for part in self.header["parts"]}

    def track(self, name, group="true"):
        """Positions (T, 3) of a frame."""
        number = self.header["frames"].index({"name": name, "group": group})
        return self.arrays["poses"][:, number, :3]


def _widen(poses, width):
    extra = ((0, 0), (0, width - poses.shape[1]), (0, 0))
    return np.pad(poses, extra, constant_values=np.nan)
