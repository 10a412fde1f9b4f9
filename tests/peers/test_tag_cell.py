"""A cell of files of other programs: an arm of URDF, a calibration of ROS, a printed tag."""

import shutil
from pathlib import Path

import numpy as np
import pytest

import robsim as rs

ROOT = Path(__file__).parents[2]
FILES = ROOT / "examples" / "tag_cell"
BOARD = rs.vision.Board("DICT_4X4_50", columns=4, rows=3, square=0.03, tag=0.02)


@pytest.fixture
def cell(tmp_path):
    shutil.copytree(FILES, tmp_path / "cell")
    return tmp_path / "cell" / "cell.toml"


def test_the_page_shows_the_file_of_thirty_lines():
    text = (FILES / "cell.toml").read_text()
    assert len(text.splitlines()) <= 30
    assert f"```toml\n{text}```" in (ROOT / "docs" / "cameras.md").read_text()


def test_it_arrives_and_is_repeated_without_its_files(cell):
    experiment = rs.load_scenario(cell)
    assert experiment.scene.camera().camera == rs.Camera.from_file(FILES / "ost.yaml")
    run = experiment.run()
    assert run["outcome"] == rs.Outcome.CONVERGED
    shutil.rmtree(cell.parent)
    assert rs.replay(run).identical(run)
    assert rs.Experiment.of(run).hash == experiment.hash


def test_its_short_text_refers_to_its_files(cell):
    experiment = rs.load_scenario(cell)
    text = experiment.to_toml(folder=cell.parent)
    assert 'urdf = "arm.urdf"' in text and 'calibration = "ost.yaml"' in text
    assert len(text.splitlines()) <= 40
    cell.write_text(text)
    assert rs.load_scenario(cell) == experiment


def test_its_detector_sees_the_marks_that_the_simulation_uses(cell):
    """Rendered through the lens of the file."""
    experiment = rs.load_scenario(cell)
    scene, q = experiment.scene, experiment.start
    tag, camera = scene.object("plate").target, scene.camera("eye").camera
    T_c_o = scene.pose("eye", q).inv() @ scene.pose("plate", q)
    seen = rs.vision.TagDetector([tag])(rs.vision.render_targets(camera, {tag: T_c_o.matrix}))
    wanted = scene.view(q, points="plate").pixels
    np.testing.assert_allclose(seen[tag.name], wanted, rtol=0, atol=0.025)


def test_a_calibration_that_changes_is_noticed(cell):
    digest = rs.load_scenario(cell).scene.camera().camera.origin.sha256
    pinned = f'calibration = {{ file = "ost.yaml", sha256 = "{digest}" }}'
    cell.write_text(cell.read_text().replace('calibration = "ost.yaml"', pinned))
    assert rs.load_scenario(cell).scene.camera().camera.origin.sha256 == digest
    lens = cell.parent / "ost.yaml"
    lens.write_text(lens.read_text().replace("612.4", "622.4"))
    with pytest.raises(rs.errors.FileError, match=r"cameras.eye.calibration: .*ost.yaml: the cont"):
        rs.load_scenario(cell)


def test_the_squares_of_a_board_are_where_it_is_black():
    paper, *squares = BOARD.shapes
    middles = np.array([square.vertices[:, :2].mean(axis=0) for square in squares])
    assert len(squares) == 6 and BOARD.is_black(*middles.T).all()
    low, high = paper.vertices[:, :2].min(axis=0), paper.vertices[:, :2].max(axis=0)
    np.testing.assert_allclose([low, high], BOARD.paper, rtol=0, atol=1e-15)
