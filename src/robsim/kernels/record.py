"""From the run-last arrays of a chunk into the run-first record of all runs."""

from typing import Any, NamedTuple

from robsim.kernels.jit import kernel, part


class Track(NamedTuple):
    """Some moments of all runs, each (runs, moments, width)."""

    q: Any
    qd: Any
    rates: Any
    s: Any
    pixels: Any


@part
def _store(values, rows, moment, out):
    """out[rows[b], moment, i] = values[i, b]."""
    for b in range(rows.size):
        for i in range(values.shape[0]):
            out[rows[b], moment, i] = values[i, b]


@kernel
def store(rows, moment, q, qd, rates, s, pixels, track):
    """One moment of the runs `rows`."""
    _store(q, rows, moment, track.q)
    _store(qd, rows, moment, track.qd)
    _store(rates, rows, moment, track.rates)
    _store(s, rows, moment, track.s)
    for n in range(pixels.shape[0]):
        for r in range(2):
            for b in range(rows.size):
                track.pixels[rows[b], moment, 2 * n + r] = pixels[n, r, b]
