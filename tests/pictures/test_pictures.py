"""Pictures of scenes against rays, against projected points, and against each other."""

import struct
import zlib

import numpy as np
import pytest
from ray_casting import cast_picture, find_psnr

import robsim as rs
from robsim.shapes import Ball, Block, BlockPictures, GreyPicture, Light, Poster, Wheel

LENSES = {
    "pinhole": {},
    "barrel": {"distortion": (-0.25, 0.06, 0.001, -0.002)},
    "rational": {"distortion": (0.1, 0.02, 0.0, 0.0, 0.01, 0.2, 0.05, 0.0)},
    "fisheye": {"distortion": (-0.02, 0.01, 0.0, 0.0), "lens": "fisheye"},
}
K = np.array([[84.0, 1.8, 46.9], [0.0, 90.0, 36.7], [0.0, 0.0, 1.0]])  # with skew, off centre
LIGHT = Light((0.3, 0.4, 0.87), ambient=0.4)
FULL = Light(ambient=1.0)


def build_camera(lens="pinhole", size=(96, 72)):
    return rs.MountedCamera("eye", rs.Camera(K, size, **LENSES[lens]))


def draw_clouds(rows=360, columns=480):
    """Return a picture with the spectrum of a smooth natural image."""
    frequency = np.hypot(np.fft.fftfreq(rows)[:, None], np.fft.rfftfreq(columns))
    frequency[0, 0] = np.inf
    phase = np.random.default_rng(0).uniform(0, 2 * np.pi, frequency.shape)
    values = np.fft.irfft2(np.exp(1j * phase) / frequency**1.5, s=(rows, columns))
    return np.rint(np.clip(127.5 + 50 * values / values.std(), 0, 255)).astype(np.uint8)


def build_wall(tilt, turn, depth=1.6, width=5.0):
    poster = Poster(draw_clouds(), width)
    pose = rs.Pose.at(0.05, -0.02, depth, rpy=(tilt, 0, turn))
    return rs.Scene(objects=rs.Object("wall", poster, pose=pose), cameras=build_camera())


@pytest.mark.parametrize("tilt", [0.0, 0.4, np.pi / 4])
@pytest.mark.parametrize(("samples", "least"), [(1, 46.0), (2, 55.0)])
@pytest.mark.few(1)
def test_a_poster_is_as_by_144_rays(tilt, samples, least):
    scene = build_wall(tilt, turn=0.2)
    exact = cast_picture(scene, "eye", [], FULL, background=50.0)
    assert find_psnr(scene.picture(samples=samples, light=FULL, exact=True), exact) > least


@pytest.mark.full
@pytest.mark.parametrize("lens", LENSES)
def test_solids_hide_each_other_as_by_rays(lens):
    solids = [
        rs.Object(
            "block",
            Block(0.3, 0.2, 0.4, albedo=0.9),
            pose=rs.Pose.at(-0.2, 0, 1.4, rpy=(0.5, 0.7, 0.2)),
        ),
        rs.Object(
            "near",
            Block(0.1, 0.5, 0.1, albedo=0.2),
            pose=rs.Pose.at(0.0, 0, 1.1, rpy=(0.1, 0.3, 0.9)),
        ),
        rs.Object(
            "through", Block(0.6, 0.1, 0.1), pose=rs.Pose.at(-0.1, 0.1, 1.4, rpy=(0.2, -0.5, 0.3))
        ),
        rs.Object(
            "wheel", Wheel(0.2, 0.1, n=12), pose=rs.Pose.at(0.35, 0.1, 1.5, rpy=(1.0, 0.4, 0))
        ),
        rs.Object("wall", Poster(draw_clouds(), 1.2), pose=rs.Pose.at(0, 0, 2, rpy=(0.2, 0.1, 0))),
    ]
    scene = rs.Scene(objects=solids, cameras=build_camera(lens))
    exact = cast_picture(scene, "eye", [], LIGHT, background=50.0)
    coarse = scene.picture(light=LIGHT, exact=True)
    fine = scene.picture(light=LIGHT, samples=2, exact=True)
    assert find_psnr(coarse, exact) > 36  # faces of which no pixel sees the centre are missing
    assert find_psnr(fine, exact) > 42
    assert np.median(abs(fine - exact)) < 0.5


def find_centroid(image, near):
    """Return the centroid (2,) of the grey values within 9 px of a pixel."""
    y, x = np.mgrid[: image.shape[0], : image.shape[1]]
    weights = np.where(np.hypot(x - near[0], y - near[1]) < 9, image, 0.0)
    return np.array([(weights * x).sum(), (weights * y).sum()]) / weights.sum()


@pytest.mark.parametrize("lens", LENSES)
@pytest.mark.few(1)
def test_the_middle_of_a_spot_is_where_the_camera_projects_it(lens):
    rows, columns = np.mgrid[:301, :301] - 150.0
    spot = np.rint(200 * np.exp(-(rows**2 + columns**2) / (2 * 20.0**2))).astype(np.uint8)
    camera = build_camera(lens)
    for place in ([0.1, 0.05, 1.0], [-0.3, -0.2, 1.0], [0.25, 0.2, 0.8]):
        thing = rs.Object("spot", Poster(spot, 0.3), pose=rs.Pose.at(*place))
        scene = rs.Scene(objects=thing, cameras=camera)
        image = scene.picture(samples=2, light=FULL, exact=True)
        expected = camera.camera.project([place], rs.Pose.at())[0]
        middle = find_centroid(image, expected)
        by_rays = find_centroid(cast_picture(scene, "eye", [], FULL, background=50.0), expected)
        assert np.linalg.norm(middle - by_rays) < 0.003
        assert np.linalg.norm(middle - expected) < 0.12  # a lens moves the middle of a wide spot


@pytest.mark.parametrize("faces", [(), ("top", "back", "left"), ("bottom", "front", "right")])
@pytest.mark.parametrize("turn", [0.0, np.pi])
def test_pictures_on_the_faces_of_a_block_are_as_by_rays(faces, turn):
    clouds = draw_clouds(90, 120)
    clouds[:45, :60] = 255  # the upper left quarter
    pictures = BlockPictures(**dict.fromkeys(faces, clouds))
    own = {"pictures": pictures} if faces else {"picture": clouds}
    shape = Block(0.5, 0.4, 0.3, albedo=0.2, pose=rs.Pose.at(0.1, 0, 0), **own)
    for rpy in ((0.6, 0.5, 0.3), (-0.6 + np.pi, 0.5, 0.3)):
        pose = rs.Pose.at(-0.1, 0, 0.9, rpy=rpy) @ rs.Pose.at(rpy=(0, 0, turn))
        scene = rs.Scene(objects=rs.Object("box", shape, pose=pose), cameras=build_camera())
        exact = cast_picture(scene, "eye", [], LIGHT, places=6, background=50.0)
        assert find_psnr(scene.picture(light=LIGHT, samples=2, exact=True), exact) > 42


def test_a_picture_on_a_single_face_replaces_the_picture_of_all():
    grey = [np.full((2, 2), 20 * k, dtype=np.uint8) for k in range(3)]
    block = Block(1, 1, 1, picture=grey[1], pictures=BlockPictures(top=grey[2]))
    values = [block.face_pictures[k].picture.grey[0, 0] for k in range(6)]
    assert values == [20, 40, 20, 20, 20, 20]  # the top is the second face


def test_a_single_picture_has_the_bits_of_a_batch():
    arm = rs.load_scenario(rs.examples.path("eye_in_hand"))
    q = np.array(arm.scene.home) + 0.05 * np.arange(3)[:, None]
    batch = arm.scene.picture(q, exact=True)
    alone = [arm.scene.picture(each, exact=True) for each in q]
    np.testing.assert_array_equal(batch, alone)


def test_light_follows_the_law_of_lambert():
    wall = rs.Object("wall", Block(4, 4, 0.1, albedo=0.8), pose=rs.Pose.at(0, 0, 2))
    scene = rs.Scene(objects=wall, cameras=build_camera())
    for angle in (0.0, 0.5, 1.2, 2.0):
        light = Light((np.sin(angle), 0, np.cos(angle)), ambient=0.25)
        lit = 0.25 + 0.75 * max(0.0, np.cos(angle))
        assert scene.picture(light=light, exact=True)[36, 48] == pytest.approx(204 * lit, rel=1e-6)


def test_the_back_of_a_poster_is_plain_and_a_poster_behind_the_camera_unseen():
    poster = Poster(draw_clouds(), 1.0, albedo=0.4)
    for pose, grey in ((rs.Pose.at(0, 0, 1, rpy=(0, np.pi, 0)), 102), (rs.Pose.at(0, 0, -1), 50)):
        scene = rs.Scene(objects=rs.Object("wall", poster, pose=pose), cameras=build_camera())
        assert scene.picture(light=FULL)[36, 48] == grey


def test_a_face_reaches_behind_the_camera():
    floor = rs.Object("floor", Block(20, 0.1, 20, albedo=0.4), pose=rs.Pose.at(0, 1, 0))
    scene = rs.Scene(objects=floor, cameras=build_camera())
    exact = cast_picture(scene, "eye", [], FULL, background=50.0)
    assert find_psnr(scene.picture(light=FULL, exact=True), exact) > 50


def test_a_camera_inside_a_body_does_not_see_it():
    scene = rs.Scene(objects=rs.Object("ball", Ball(0.5)), cameras=build_camera())
    assert (scene.picture(background=7) == 7).all()


@pytest.mark.parametrize(
    ("picture", "text"),
    [
        (
            np.zeros((3, 4)),
            "expected grey values of uint8, shape (h, w), got float64, shape (3, 4)",
        ),
        (np.zeros((3, 4, 4), np.uint8), "expected grey values of uint8"),
        (np.zeros((0, 4), np.uint8), "expected grey values of uint8"),
        (np.zeros((3, 4), np.uint16), "got uint16"),
        (np.broadcast_to(np.uint8(0), (10_000, 5_001)), "50010000 pixels; at most 50000000"),
        (np.full((2, 2), np.nan), "got float64"),
        (None, "expected grey values of uint8"),
    ],
)
def test_arrays_that_are_no_picture(picture, text):
    with pytest.raises(rs.errors.InputError, match=text.replace("(", r"\(").replace(")", r"\)")):
        Poster(picture, 1.0)


def encode_png(width, height, bits, kind, rows=None):
    """Return a PNG file of black rows; the header may state more rows than there are."""
    samples = {0: 1, 2: 3}[kind]
    row = bytes(1 + width * samples * bits // 8)
    parts = {
        b"IHDR": struct.pack(">IIBBBBB", width, height, bits, kind, 0, 0, 0),
        b"IDAT": zlib.compress(row * (rows or height)),
        b"IEND": b"",
    }
    chunks = [
        struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
        for name, data in parts.items()
    ]
    return b"\x89PNG\r\n\x1a\n" + b"".join(chunks)


def test_a_colour_picture_is_grey_by_its_luminance(tmp_path):
    from PIL import Image

    colors = np.random.default_rng(0).integers(0, 256, (20, 30, 3), dtype=np.uint8)
    Image.fromarray(colors).save(tmp_path / "colors.png")
    grey = GreyPicture.from_file(tmp_path / "colors.png").grey
    np.testing.assert_allclose(grey, colors @ [0.299, 0.587, 0.114], atol=0.51)


def test_files_that_are_no_picture(tmp_path):
    from PIL import Image

    grey = draw_clouds(30, 40)
    Image.fromarray(grey).save(tmp_path / "grey.png")
    Image.fromarray(np.dstack([grey] * 4)).save(tmp_path / "alpha.png")
    Image.fromarray(grey.astype(np.uint16) * 257).save(tmp_path / "deep.png")
    Image.fromarray(grey.astype(np.float32)).save(tmp_path / "float.tiff")
    Image.fromarray(grey).convert("P").save(tmp_path / "clear.png", transparency=0)
    (tmp_path / "deep.ppm").write_bytes(b"P6 4 3 65535\n" + bytes(72))
    (tmp_path / "deep_colors.png").write_bytes(encode_png(4, 3, bits=16, kind=2))
    (tmp_path / "huge.png").write_bytes(encode_png(10_000, 5_001, bits=8, kind=0, rows=1))
    (tmp_path / "bomb.png").write_bytes(encode_png(100_000, 100_000, bits=8, kind=0, rows=1))
    Image.fromarray(grey).save(tmp_path / "program.eps")
    Image.fromarray(grey).save(tmp_path / "paper.pdf")
    (tmp_path / "cut.png").write_bytes((tmp_path / "grey.png").read_bytes()[:200])
    (tmp_path / "text.png").write_text("no picture")
    assert GreyPicture.from_file(tmp_path / "grey.png") == GreyPicture(grey)
    for name, text in {
        "alpha.png": "mode 'RGBA'; expected 8 bits, without an alpha channel",
        "deep.png": "mode 'I;16'; expected 8 bits",
        "float.tiff": "mode 'F'; expected 8 bits",
        "clear.png": "mode 'P'; expected 8 bits, without an alpha channel",
        "deep.ppm": "a picture of 16 bits; expected 8 bits",
        "deep_colors.png": "a picture of 16 bits; expected 8 bits",
        "huge.png": "10000 x 5001 pixels; at most 50000000",
        "bomb.png": "more than 50000000 pixels",
        "program.eps": "no picture of PNG, JPEG",
        "paper.pdf": "no picture of PNG, JPEG",
        "cut.png": "cannot be read",
        "text.png": "no picture of PNG, JPEG",
        "none.png": "no such file",
    }.items():
        with pytest.raises(rs.errors.FileError, match=text):
            Poster(tmp_path / name, 1.0)


def test_requests_that_cannot_be_drawn():
    scene = build_wall(0.0, 0.0)
    for given in (0, 9, 1.5, "2"):
        with pytest.raises(rs.errors.InputError, match="samples"):
            scene.picture(samples=given)
    for given in (-1, 256, np.nan, "black"):
        with pytest.raises(rs.errors.InputError, match="background"):
            scene.picture(background=given)
    with pytest.raises(rs.errors.InputError, match="light: expected a Light, got"):
        scene.picture(light=(0, 0, 1))
    wrong = [{"direction": each} for each in ("up", (0, 0, 0), (1e300, 0, 0), (0, 1e-200, 0))]
    for given in ({"ambient": 2}, *wrong):
        with pytest.raises(rs.errors.InputError, match=next(iter(given))):
            Light(**given)
    with pytest.raises(rs.errors.InputError, match="no camera 'ey'"):
        scene.picture(camera="ey")
    boundless = rs.Scene(cameras=rs.MountedCamera("eye", rs.Camera(K)))
    with pytest.raises(rs.errors.InputError, match="camera 'eye' has no size"):
        boundless.picture()
