"""The picture of a camera, in one call."""

from robsim.kernels.machine.jit import kernel
from robsim.kernels.raster.edge_coverage import smooth_edges
from robsim.kernels.raster.face_placement import place_faces
from robsim.kernels.raster.pixel_faces import find_pixel_faces
from robsim.kernels.raster.pixel_shades import shade_pixels


@kernel
def draw_picture(faces, pictures, plane, T_c_b, light, background, pattern, placed, buffers, image):
    """Compute the grey values image (h, w) of bodies at poses T_c_b (bodies, 3, 4).

    The other arguments are described in `raster_arrays`, and at the kernels that this one calls.
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
