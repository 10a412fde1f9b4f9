"""Pictures by rays through many places of each pixel, in NumPy: the oracle of the rasteriser."""

import numpy as np

from robsim.shapes import Block, Poster


def cast_picture(scene, camera, q, light, places=12, background=128.0):
    """Return the grey values (h, w): the mean of places x places rays of each pixel."""
    eye = scene.camera(camera)
    width, height = eye.camera.size
    inner = (np.arange(places) + 0.5) / places - 0.5
    x = (np.arange(width)[:, None] + inner).ravel()
    y = (np.arange(height)[:, None] + inner).ravel()
    pixels = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    rays = np.column_stack([eye.camera.normalise(pixels), np.ones(len(pixels))])
    grey, depth = np.full(len(rays), background), np.full(len(rays), np.inf)
    T_c_w = scene.pose(eye.name, q).inv()
    toward = T_c_w.rotation @ light.unit_direction
    for thing in scene.objects:
        T = (T_c_w @ scene.pose(thing.name, q)).matrix
        for shape in thing.shapes:
            for number, corners in enumerate(_list_faces(shape)):
                _paint(shape, number, corners, T, rays, toward, light.ambient, grey, depth)
    fine = grey.reshape(height, places, width, places)
    return fine.mean(axis=(1, 3))


def _list_faces(shape):
    points, faces = shape.skin
    return [points[list(face)] for face in faces]


def _paint(shape, number, corners, T, rays, toward, ambient, grey, depth):
    """Enter a face: rays meet its plane, and the point lies on the inner side of each edge."""
    P = corners @ T[:3, :3].T + T[:3, 3]
    normal = np.cross(P[1] - P[0], P[2] - P[0])
    normal /= np.linalg.norm(normal)
    if normal @ P[0] >= 0:
        return
    with np.errstate(divide="ignore"):
        z = normal @ P[0] / (rays @ normal)
    points = rays * z[:, None]
    hit = (z > 0) & (z < depth)
    for a, b in zip(P, np.roll(P, -1, axis=0), strict=True):
        hit &= (points - a) @ np.cross(normal, b - a) >= 0
    lit = ambient + (1 - ambient) * max(0.0, -normal @ toward)
    depth[hit] = z[hit]
    local = shape.pose.inv() @ ((points[hit] - T[:3, 3]) @ T[:3, :3])
    picture, x, y = _find_picture(shape, number, local)
    if picture is not None:
        grey[hit] = lit * _read(picture.grey.astype(float), x, y)
    else:
        grey[hit] = lit * 255 * shape.albedo


# the axes to the right and upwards of a face of a block, as seen from outside
BLOCK_AXES = {
    "bottom": "-x+y",
    "top": "+x+y",
    "right": "+x+z",
    "front": "+y+z",
    "left": "-x+z",
    "back": "-y+z",
}


def _find_picture(shape, number, points):
    """Return the picture of a face, and its coordinates from -0.5 to 0.5, to the right and down."""
    if isinstance(shape, Poster):
        front = shape.picture if number == 0 else None
        return front, points[:, 0] / shape.width, points[:, 1] / shape.height
    given, name = None, ""
    if isinstance(shape, Block):
        name = list(BLOCK_AXES)[number]
        given = getattr(shape.pictures, name, None) or shape.picture
    if given is None:
        return None, None, None
    sides = dict(zip("xyz", (shape.length, shape.width, shape.height), strict=True))
    shares = {axis: points[:, k] / sides[axis] for k, axis in enumerate("xyz")}
    signs = {"+": 1, "-": -1}
    right_sign, right, up_sign, up = BLOCK_AXES[name]
    return given, signs[right_sign] * shares[right], -signs[up_sign] * shares[up]


def _read(values, x, y):
    """Return the picture at places from -0.5 to 0.5, between the four nearest texels."""
    rows, columns = values.shape
    u, v = (x + 0.5) * columns - 0.5, (y + 0.5) * rows - 0.5
    u, v = np.clip(u, 0, columns - 1), np.clip(v, 0, rows - 1)
    i, j = np.minimum(u.astype(int), columns - 2), np.minimum(v.astype(int), rows - 2)
    a, b = u - i, v - j
    upper = (1 - a) * values[j, i] + a * values[j, i + 1]
    lower = (1 - a) * values[j + 1, i] + a * values[j + 1, i + 1]
    return (1 - b) * upper + b * lower


def find_psnr(image, exact):
    """Return the peak signal-to-noise ratio in dB."""
    square = np.mean((np.asarray(image, float) - exact) ** 2)
    return float(10 * np.log10(255**2 / square)) if square else np.inf
