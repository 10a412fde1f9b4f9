"""Pictures of a camera, in one call."""

from robsim.kernels.machine.entry import entry
from robsim.kernels.machine.intrinsics import fragment
from robsim.kernels.raster.edge_coverage import smooth_edges
from robsim.kernels.raster.face_placement import place_faces
from robsim.kernels.raster.pixel_faces import find_pixel_faces
from robsim.kernels.raster.pixel_shades import shade_pixels
from robsim.kernels.raster.raster_arrays import (
    FACES,
    LENS_PLANE,
    NO_PICTURES,
    PICTURES,
    PINHOLE_PLANE,
    PIXEL_BUFFERS,
    PLACED_FACES,
    Faces,  # noqa: F401  a name in the declared types, as the following ones
    ImagePlane,  # noqa: F401
    Pictures,  # noqa: F401
    PixelBuffers,  # noqa: F401
    PlacedFaces,  # noqa: F401
)

_REST = (
    "float64[:, :, :, ::1], float64[:, ::1], float64, float32[:, ::1], int64, "
    f"out {PLACED_FACES}, out {PIXEL_BUFFERS}, out float32[:, ::1], out float32[:, :, ::1]"
)


@entry(
    f"{FACES}, {NO_PICTURES}, {PINHOLE_PLANE}, {_REST}",
    f"{FACES}, {PICTURES}, {PINHOLE_PLANE}, {_REST}",
    f"{FACES}, {NO_PICTURES}, {LENS_PLANE}, {_REST}",
    f"{FACES}, {PICTURES}, {LENS_PLANE}, {_REST}",
)
def draw_pictures(
    faces,
    pictures,
    plane,
    T_c_b,
    light,
    background,
    pattern,
    samples,
    placed,
    buffers,
    fine,
    images,
):
    """Compute the grey values images (B, h, w) of bodies at poses T_c_b (B, bodies, 3, 4).

    Parameters
    ----------
    faces, pictures, plane, placed, buffers : named tuples
        Arrays that `raster_arrays` describes; `placed` and `buffers` are overwritten.
    T_c_b : array of shape (B, bodies, 3, 4)
        Poses of the bodies in camera axes.
    light : array of shape (B, 4)
        Unit direction of the light in camera axes, and the share of light from everywhere.
    background : float
        Grey value of pixels without a face.
    pattern : array of shape (2, n)
        Places in a pixel at an edge, from -0.5 to 0.5.
    samples : int
        Divisions along each side of a pixel.
    fine : array of float32, shape (h samples, w samples)
        Buffer of a picture with its samples; without rows if `samples` is 1.
    images : array of float32, shape (B, h, w)
        Grey values, the result.
    """
    for k in range(len(images)):
        image = images[k] if samples == 1 else fine
        height, width = image.shape
        place_faces(faces, T_c_b[k], plane, light[k], width, height, placed)
        find_pixel_faces(faces, plane, placed, buffers)
        texels, rest = pictures.texels, (plane, placed, background)
        shade_pixels(faces, pictures, texels, *rest, buffers, image)
        smooth_edges(faces, pictures, texels, *rest, pattern, buffers, image)
        if samples > 1:
            _average_blocks(fine, samples, images[k])


@fragment
def _average_blocks(image, count, out):
    """Compute the means out (h, w) of blocks of count x count pixels of an image."""
    height, width = out.shape
    for y in range(height):
        for x in range(width):
            total = 0.0
            for j in range(count):
                for i in range(count):
                    total += image[y * count + j, x * count + i]
            out[y, x] = total / (count * count)
