"""A camera of a scenario file that is `calibration = "ost.xml"`: read, changed and repeated."""

import hashlib

import pytest

import robsim as rs

LENS = rs.Camera(
    [[812.3, 0, 321.7], [0, 811.9, 238.4], [0, 0, 1]],
    (640, 480),
    distortion=(-0.28, 0.07, 1e-3, 2e-4),
)
COLMAP = """# cameras of a phone and of an action camera
1 PINHOLE 640 480 500 501 320.5 240.5
2 FOV 640 480 300 300 320 240 0.9
3 SIMPLE_RADIAL 640 480 600 320.5 240.5 -0.1
"""
TEXT = """
schema = 1
robots = [{ model = "free_camera" }]
[[objects]]
name = "plate"
position = "0, 0, 50 cm"
marks = ["-5, -5, 0 cm", "5, -5, 0 cm", "5, 5, 0 cm", "-5, 5, 0 cm"]
[[cameras]]
name = "eye"
on = "free_camera.body"
calibration = "lenses/ost.xml"
[task]
kind = "ibvs"
[start]
q = ["2 cm", "1 cm", "-10 cm", 0, 0, 0, 1]
[run]
duration = "400 ms"
"""


@pytest.fixture
def bench(tmp_path):
    """Load the scenario file, changed."""
    (tmp_path / "lenses").mkdir()
    LENS.to_file(tmp_path / "lenses" / "ost.xml")
    (tmp_path / "lenses" / "cameras.txt").write_text(COLMAP)

    def load(old="", new="", changes=()):
        assert old in TEXT
        (tmp_path / "bench.toml").write_text(TEXT.replace(old, new, 1))
        return rs.load_scenario(tmp_path / "bench.toml", changes)

    load.folder, load.file = tmp_path, tmp_path / "lenses" / "ost.xml"
    load.digest = hashlib.sha256(load.file.read_bytes()).hexdigest()
    return load


def read_again(experiment, folder):
    """Return the experiment of its own short text, and the text."""
    text = experiment.to_toml(folder=folder)
    (folder / "again.toml").write_text(text)
    again = rs.load_scenario(folder / "again.toml")
    assert again == experiment and again.hash == experiment.hash
    return text


def test_it_is_the_camera_of_the_file(bench):
    camera = bench().scene.camera("eye").camera
    assert camera == LENS
    origin = camera.origin
    assert (origin.file, origin.camera, origin.sha256) == ("lenses/ost.xml", None, bench.digest)
    assert rs.Camera.from_file(bench.file).origin.sha256 == bench.digest
    assert 'calibration = "lenses/ost.xml"' in read_again(bench(), bench.folder)


def test_its_run_stores_values_and_hash_and_is_repeated_without_the_file(bench):
    experiment = bench()
    run = experiment.run()
    bench.file.unlink()
    text = run.attrs["scenario"]
    assert bench.digest in text and "812.3" in text and str(bench.folder) not in text
    assert rs.replay(run).identical(run)
    stored = rs.Experiment.of(run)
    assert stored == experiment and stored.hash == experiment.hash
    assert stored.scene.camera().camera.origin == experiment.scene.camera().camera.origin
    assert bench.digest in read_again(stored, bench.folder)  # no reference to a missing file


def test_a_file_of_another_content_is_written_by_value(bench):
    experiment = bench()
    LENS.revised(focal=700).to_file(bench.file)
    assert "812.3" in read_again(experiment, bench.folder)
    digest = f'calibration = {{ file = "lenses/ost.xml", sha256 = "{bench.digest}" }}'
    with pytest.raises(
        rs.errors.FileError, match=f"ost.xml: the content has changed: .*{bench.digest}"
    ):
        bench('calibration = "lenses/ost.xml"', digest)


@pytest.mark.parametrize(
    ("name", "value"),
    [("focal", 900), ("size", [600, 400]), ("distortion", [0.0, 0.0, 0.0, 0.0]), ("skew", 1.0)],
)
def test_a_changed_camera_is_no_longer_the_one_of_the_file(bench, name, value):
    camera = bench().at(f"cameras.eye.{name}", value).scene.camera().camera
    assert camera.origin is None and camera == LENS.revised(**{name: value})
    assert "calibration" not in read_again(bench().at(f"cameras.eye.{name}", value), bench.folder)


def test_a_moved_camera_is_the_one_of_the_file(bench):
    moved = bench().at("cameras.eye.position", "0, 0, 1 cm")
    assert moved.scene.camera().camera.origin.sha256 == bench.digest
    assert 'calibration = "lenses/ost.xml"' in read_again(moved, bench.folder)


def test_another_file_replaces_the_camera(bench):
    new = {"file": "lenses/cameras.txt", "camera": "3"}
    other = bench().at("cameras.eye.calibration", new)
    assert other.scene.camera().camera.K[0, 0] == 600
    assert 'camera = "3"' in read_again(other, bench.folder)
    numbers = bench().at("cameras.eye.focal", 900).at("cameras.eye.calibration", "lenses/ost.xml")
    assert numbers == bench()


def test_a_belief_differs_in_numbers(bench):
    experiment = bench("[task]", '[[belief.cameras]]\nname = "eye"\nfocal = 850\n[task]')
    believed = experiment.task.belief.camera().camera
    assert believed == LENS.revised(focal=850) and believed.origin is None
    assert "focal = [850, 850]" in read_again(experiment, bench.folder)


def test_the_size_is_given_if_the_file_has_none(bench):
    rs.Camera(LENS.K, distortion=LENS.distortion).to_file(bench.file)
    experiment = bench("calibration", "size = [640, 480]\ncalibration")
    assert experiment.scene.camera().camera == LENS
    text = read_again(experiment, bench.folder)
    assert 'calibration = "lenses/ost.xml"' in text and "size = [640, 480]" in text
    run = experiment.run()
    bench.file.unlink()
    assert rs.replay(run).identical(run)


@pytest.mark.parametrize(
    ("new", "told"),
    [
        ('calibration = "ost.xml"', "calibration: .*/ost.xml: no such file"),
        ('calibration = "lenses"', "calibration: .*/lenses: this is a folder; expected a calib"),
        ('calibration = "/dev/zero"', "calibration: /dev/zero: this is a device"),
        ('calibration = "bench.toml"', "calibration: .*bench.toml"),
        ("calibration = 3", "calibration: must be the path of a calibration file, .* got 3"),
        ('calibration = ""', "calibration: must be the path of a calibration file, .* got ''"),
        ("calibration = {}", "calibration.file: missing"),
        ('calibration = { files = "a" }', "calibration.files: unknown key 'files'; did you mean"),
        (
            'calibration = { file = "lenses/ost.xml", size = [1, 2] }',
            "calibration: size and distortion: give them with K",
        ),
        (
            'calibration = "lenses/cameras.txt"',
            "calibration: .*cameras.txt: 3 cameras, 1, 2, 3: choose one .* by camera=",
        ),
        (
            'calibration = { file = "lenses/cameras.txt", camera = "2" }',
            "calibration: .*cameras.txt:3: 'FOV' is not supported",
        ),
        (
            'calibration = { file = "lenses/cameras.txt", camera = "4" }',
            "calibration: .*cameras.txt: no camera '4'; .*cameras: 1, 2, 3",
        ),
        ('focal = 800\ncalibration = "lenses/ost.xml"', "focal and calibration: give one of them"),
        (
            'distortion = [0.1, 0.0, 0.0, 0.0]\ncalibration = "lenses/ost.xml"',
            "distortion and calibration: give one of them only",
        ),
        (
            'lens = "fisheye"\ncalibration = "lenses/ost.xml"',
            "lens and calibration: give one of them only",
        ),
        (
            'calibration = { file = "lenses/ost.xml", lens = "fisheye" }',
            "calibration: .*ost.xml: lens='fisheye', but the file has a perspective lens",
        ),
        (
            'calibration = { file = "lenses/ost.xml", lens = "equidistant" }',
            "calibration.lens: .*'equidistant'",
        ),
        ('focal = 800\nlens = "fishye"', "lens: must be 'perspective' or 'fisheye', got 'fish"),
        (
            'size = [4, 4]\nfocal = 800\nlens = "fisheye"\ndistortion = [1, 2, 3, 4, 5]',
            "distortion: distortion: expected 0 or 4 numbers .k1 k2 k3 k4. of a fisheye lens",
        ),
        (
            'size = [320, 240]\ncalibration = "lenses/ost.xml"',
            r"calibration: size \[320, 240\], but the calibration is for \[640, 480\]",
        ),
    ],
)
def test_each_fault_is_reported_with_its_key(bench, new, told):
    with pytest.raises(rs.errors.FileError, match=rf"bench.toml: cameras.eye(\.|: ){told}"):
        bench('calibration = "lenses/ost.xml"', new)


def test_an_unknown_lens_refuses_only_its_own_camera(bench):
    path = bench.folder / "lenses" / "cameras.txt"
    assert rs.Camera.from_file(path, "1").K[0].tolist() == [500, 0, 320]
    assert rs.Camera.from_file(path, "3").distortion == (-0.1, 0, 0, 0)
    with pytest.raises(rs.errors.FileError, match=r"cameras.txt:3: 'FOV' is not supp"):
        rs.Camera.from_file(path, "2")
    path.write_text(COLMAP.replace("FOV", "RADIAL_FISHEYE").replace("300 300", "300"))
    with pytest.raises(rs.errors.FileError, match=r"cameras.txt:3: RADIAL_FISHEYE has 5 param"):
        rs.Camera.from_file(path, "2")
    path.write_text(COLMAP.replace("FOV", "SIMPLE_RADIAL_FISHEYE").replace("300 300", "300"))
    fisheye = rs.Camera.from_file(path, "2")
    assert fisheye.distortion == (0.9, 0, 0, 0) and fisheye.lens == "fisheye"
    path.write_text(COLMAP.replace(" 500 501", " 5oo 501"))
    with pytest.raises(rs.errors.FileError, match=r"cameras.txt:2: '5oo' is not a finite number"):
        rs.Camera.from_file(path, "3")


def test_a_fisheye_of_a_file_is_that_of_its_run(bench):
    """The file names its model, or the scenario does."""
    fisheye = rs.Camera(LENS.K, LENS.size, distortion=(0.1, 0.01, 0, 0), lens="fisheye")
    fisheye.to_file(bench.file)
    named = bench()
    assert named.scene.camera().camera == fisheye
    text = bench.file.read_text().replace("<fisheye_model>1</fisheye_model>", "")
    bench.file.write_text(text.replace("<distortion_model>equidistant</distortion_model>", ""))
    assert bench().scene.camera().camera.lens == "perspective"
    table = '{ file = "lenses/ost.xml", lens = "fisheye" }'
    told = bench('"lenses/ost.xml"', table)
    assert told.scene.camera().camera == fisheye
    text = read_again(told, bench.folder)
    assert 'lens = "fisheye"' in text and "812.3" not in text
    for case in (named, told):
        run = case.run()
        assert rs.Experiment.from_text(run.attrs["scenario"]).scene.camera().camera == fisheye
        assert rs.replay(run).identical(run)
    changed = told.at("cameras.eye.lens", "perspective").scene.camera().camera
    assert changed == fisheye.revised(lens="perspective") and changed.origin is None
