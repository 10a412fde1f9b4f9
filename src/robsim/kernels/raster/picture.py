"""The picture of a camera, in one call."""

from robsim.kernels.machine.jit import kernel
from robsim.kernels.raster.edge_coverage import smooth_edges
from robsim.kernels.raster.face_placement import place_faces
from robsim.kernels.raster.pixel_faces import find_pixel_faces
from robsim.kernels.raster.pixel_shades import shade_pixels


@kernel
def draw_picture(faces, pictures, plane, T_c_b, light, background, pattern, placed, buffers, image):
    """Compute the grey values image (h, w) of bodies at poses T_c_b (bodies, 3, 4).

    Parameters
    ----------
    faces, pictures, plane, placed, buffers : named tuples
        Arrays that `raster_arrays` describes; `placed` and `buffers` are overwritten.
    T_c_b : array of shape (bodies, 3, 4)
        Poses of the bodies in camera axes.
    light : array of shape (4,)
        Unit direction of the light in camera axes, and the share of light from everywhere.
    background : float
        Grey value of pixels without a face.
    pattern : array of shape (n, 2)
        Places in a pixel at an edge, from -0.5 to 0.5.
    image : array of float32, shape (h, w)
        Grey values, the result.
    """
    height, width = image.shape
    place_faces(faces, T_c_b, plane, light, width, height, placed)
    find_pixel_faces(faces, plane, placed, buffers)
    shade_pixels(faces, pictures, plane, placed, background, buffers, image)
    smooth_edges(faces, pictures, plane, placed, background, pattern, buffers, image)


@kernel
def average_blocks(image, count, out):
    """Compute the means out (h, w) of blocks of count x count pixels of an image."""
    height, width = out.shape
    for y in range(height):
        for x in range(width):
            total = 0.0
            for j in range(count):
                for i in range(count):
                    total += image[y * count + j, x * count + i]
            out[y, x] = total / (count * count)
