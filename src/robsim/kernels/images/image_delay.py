"""Stages of delayed and lost images: a ring buffer of past images, and the image in use.

An image has three rows for each of N marks: first the 2 N rows of pixels, then the N rows of
depths.
"""

import numpy as np

from robsim.kernels.machine.lanes import WIDTH, get, put, where
from robsim.kernels.machine.stages import stage


@stage
def store_image(
    w,
    step,
    n="count",
    start_image="n",
    later_image="n",
    share="row",
    ring="length, n",
    length="count",
):
    """Store the image of the period that ends now in the ring buffer.

    With share = 0 the stored image is `start_image`, taken at the start of the period. Otherwise it
    is `later_image`, taken after this share of the period.
    """
    entry = ring + n * ((step - 1) % length)
    began = get(w, share) == 0.0
    for i in range(n):
        put(w, entry + i, where(began, get(w, start_image + i), get(w, later_image + i)))


@stage
def recall_image(
    w,
    step,
    every="whole",
    n="count",
    current_image="n",
    first_image="n",
    ring="length, n",
    length="count",
    delays="row",
    out="n",
):
    """Copy the image of `delays` periods ago from the ring buffer, or the first image.

    The first image is used if the delay exceeds the number of steps.
    """
    if step % every:
        return
    count = n
    if step == 0:
        for i in range(count):
            put(w, first_image + i, get(w, current_image + i))
    for b in range(WIDTH):
        delay = int(w[delays * WIDTH + b])
        source = current_image if delay == 0 else first_image
        if 0 < delay <= step:
            source = ring + count * ((step - delay) % length)
        for i in range(count):
            w[(out + i) * WIDTH + b] = w[(source + i) * WIDTH + b]


@stage
def receive_image(
    w,
    step,
    every="whole",
    N="count",
    pixels="N, 2",
    depth="N",
    hidden="N",
    lost="row",
    delay="row",
    used_pixels="N, 2",
    used_depth="N",
    used_hidden="N",
    age="row",
):
    """Update the image in use, except for hidden marks. A lost image updates no mark.

    `pixels`, `depth` and `hidden` are the new image. The image in use is `used_pixels`,
    `used_depth` and `used_hidden`, and `age` is its age in periods. Afterwards `hidden` and `lost`
    are zero, and the stages of the next step set them.
    """
    if step % every:
        put(w, age, get(w, age) + 1.0)
        put(w, lost, 0.0)
        for n in range(N):
            put(w, hidden + n, 0.0)
        return
    threshold = np.inf if step == 0 else 0.0  # the first image is never lost, nor hidden
    is_lost = get(w, lost) > threshold
    put(w, lost, 0.0)
    for n in range(N):
        is_hidden = get(w, hidden + n)
        is_missing = is_lost | (is_hidden > threshold)
        for i in range(2):
            at = 2 * n + i
            put(
                w,
                used_pixels + at,
                where(is_missing, get(w, used_pixels + at), get(w, pixels + at)),
            )
        put(w, used_depth + n, where(is_missing, get(w, used_depth + n), get(w, depth + n)))
        put(w, used_hidden + n, where(is_lost, get(w, used_hidden + n), is_hidden))
        put(w, hidden + n, 0.0)
    put(w, age, where(is_lost, get(w, age) + 1.0, get(w, delay)))
