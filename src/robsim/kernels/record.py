"""Copying of the run-last arrays of a chunk into the run-first record of all runs."""

from typing import Any, NamedTuple

from robsim.kernels.jit import kernel, part


class Track(NamedTuple):
    """The recorded instants of all runs, each (runs, instants, width)."""

    q: Any
    qd: Any
    rates: Any
    s: Any
    pixels: Any


@part
def _store(values, rows, instant, out):
    """Store out[rows[b], instant, i] = values[i, b]."""
    for b in range(rows.size):
        for i in range(values.shape[0]):
            out[rows[b], instant, i] = values[i, b]


@kernel
def store(rows, instant, q, qd, rates, s, pixels, track):
    """Store one instant of the runs `rows`."""
    _store(q, rows, instant, track.q)
    _store(qd, rows, instant, track.qd)
    _store(rates, rows, instant, track.rates)
    _store(s, rows, instant, track.s)
    for n in range(pixels.shape[0]):
        for r in range(2):
            for b in range(rows.size):
                track.pixels[rows[b], instant, 2 * n + r] = pixels[n, r, b]
