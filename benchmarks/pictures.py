"""Pictures of cameras beside OpenCV's warp of an image (see README.md).

Run `python benchmarks/pictures.py`. OpenCV uses one thread, and warps an image without edges.
"""

import time

import numpy as np

import robsim as rs
from robsim.rendering.rendered_face import list_shape_faces, list_target_faces
from robsim.rendering.renderer import Renderer
from robsim.shapes import Poster

REPEATS = 200
LENS = (-0.25, 0.06, 0.001, -0.002)


def least(call):
    """Milliseconds of CPU of a call: the least and the median."""
    call()
    times = []
    for _ in range(REPEATS):
        start = time.thread_time_ns()
        call()
        times.append(time.thread_time_ns() - start)
    return min(times) / 1e6, float(np.median(times)) / 1e6


def build_poster():
    """Return a poster of 640 x 458 texels that is 0.6 m wide."""
    x, y = np.meshgrid(np.arange(640), np.arange(458))
    return Poster(np.rint(127 + 60 * np.sin(x / 9) * np.cos(y / 13)).astype(np.uint8), 0.6)


def rows():
    """Yield name, samples, and the milliseconds of each picture."""
    K = np.array([[870.0, 0, 159.5], [0, 870.0, 119.5], [0, 0, 1]])
    size, poster = (320, 240), list_shape_faces(build_poster())
    close, away = (
        rs.Pose.at(0, 0, depth, rpy=(0.1, -0.1, 0.2)).matrix[None] for depth in (1.0, 2.3)
    )
    for samples in (1, 2):
        for lens in ((), LENS):
            renderer = Renderer(rs.Camera(K, size, distortion=lens), [poster], samples)
            kind = "lens" if lens else "pinhole"
            yield f"poster fills the view, {kind}", samples, least(lambda r=renderer: r.draw(close))
            yield f"poster with edges, {kind}", samples, least(lambda r=renderer: r.draw(away))
    tag = list_target_faces(rs.vision.Tag("tag36h11", 7, 0.1))
    wide = rs.Camera(np.array([[800.0, 0, 319.5], [0, 800.0, 239.5], [0, 0, 1]]), (640, 480))
    for samples in (1, 2):
        renderer = Renderer(wide, [tag], samples)
        yield "tag, 640 x 480", samples, least(lambda r=renderer: r.draw(close))


def peer():
    """Milliseconds of `cv2.warpPerspective` to 320 x 240 pixels, with linear interpolation."""
    import cv2

    cv2.setNumThreads(1)
    grey = build_poster().picture.grey
    H = np.array([[1.9, 0.1, 20], [-0.1, 1.9, 20], [1e-4, 1e-4, 1]])
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    return least(lambda: cv2.warpPerspective(grey, H, (320, 240), flags=flags))


def main():
    theirs = peer()
    print(f"cv2.warpPerspective, 320 x 240: {theirs[0]:.3f} ms ({theirs[1]:.3f})")
    for name, samples, ours in rows():
        ratio = ours[0] / theirs[0]
        print(f"{name}, {samples} sample(s): {ours[0]:.3f} ms ({ours[1]:.3f}), {ratio:.1f} times")


if __name__ == "__main__":
    main()
