"""A tag or board of a scenario file: its marks are those that a detector returns."""

import dataclasses

import numpy as np
import pytest

import robsim as rs

TAG = rs.vision.Tag("tag36h11", 7, size=0.08)
BOARD = rs.vision.Board("DICT_4X4_50", columns=4, rows=3, square=0.03, tag=0.02)
TAG_TEXT = 'tag = { family = "tag36h11", id = 7, size = "8 cm" }'
BOARD_TEXT = (
    'board = { family = "DICT_4X4_50", columns = 4, rows = 3, square = "3 cm", tag = "20 mm" }'
)
TEXT = f"""
schema = 1
robots = [{{ model = "free_camera" }}]
cameras = [{{ name = "eye", on = "free_camera.body", size = [640, 480], focal = 800 }}]
task = {{ kind = "ibvs" }}
start = {{ q = ["2 cm", "1 cm", "-10 cm", 0, 0, 0, 1] }}
run = {{ duration = "400 ms" }}
[[objects]]
name = "plate"
position = "0, 0, 50 cm"
{TAG_TEXT}
"""


def load(new=TAG_TEXT):
    return rs.Experiment.from_text(TEXT.replace(TAG_TEXT, new))


@pytest.mark.parametrize(("text", "target"), [(TAG_TEXT, TAG), (BOARD_TEXT, BOARD)])
def test_it_has_the_marks_of_its_target_and_is_repeated(text, target):
    experiment = load(text)
    plate = experiment.scene.object("plate")
    assert plate.target == target and plate.shapes == ()
    np.testing.assert_array_equal(plate.marks, target.marks)
    assert text.replace("20 mm", "2 cm") in experiment.to_toml()
    run = experiment.run()
    assert rs.Experiment.of(run) == experiment and rs.replay(run).identical(run)


def test_it_is_changed_by_dotted_names():
    experiment = load()
    small = experiment.at("objects.plate.tag.size", "4 cm")
    np.testing.assert_array_equal(small.scene.object().marks, TAG.marks / 2)
    assert small.at("objects.plate.tag.size", 0.08) == experiment
    board = experiment.at(
        "objects.plate.board", dataclasses.asdict(BOARD) | {"square": "3 cm", "tag": "2 cm"}
    )
    assert board.scene.object().target == BOARD and board.scene.object().tag is None
    assert (
        board.at("objects.plate.tag", {"family": "tag36h11", "id": 7, "size": "8 cm"}) == experiment
    )
    points = experiment.at("objects.plate.marks", BOARD.marks)
    assert points.scene.object().target is None and "tag" not in points.to_toml()


def test_the_controller_may_believe_in_another_size():
    """A tag that is printed five percent too small: the true size is smaller than the believed."""
    belief = '[[belief.objects]]\nname = "plate"\ntag = { size = "84 mm" }\n'
    experiment = rs.Experiment.from_text(TEXT + belief)
    believed = experiment.task.belief.object()
    assert believed.tag == dataclasses.replace(TAG, size=0.084)
    np.testing.assert_array_equal(believed.marks, believed.tag.marks)
    assert 'tag = { size = "84 mm" }' in experiment.to_toml()
    assert rs.Experiment.of(experiment.run()) == experiment
    by_factor = load().scene.believe(size=1.05).object()
    assert by_factor.target is None
    np.testing.assert_allclose(by_factor.marks, believed.marks, rtol=0, atol=1e-15)


def test_its_size_may_differ_from_run_to_run():
    """True or believed, each run to the bit as on its own.

    A wrong belief scales the estimated motion; the true size alone does not change the path.
    """
    sizes = np.array([0.07, 0.08, 0.09])
    experiment = load().with_(task=rs.PBVS())
    for name, ends in (("objects.plate.tag.size", 1), ("belief.objects.plate.tag.size", 3)):
        batch = experiment.vary({name: sizes})
        runs = batch.run()
        for i in range(3):
            alone = batch.of_run(i)
            scene = alone.task.belief if name.startswith("belief") else alone.scene
            assert scene.object().tag.size == sizes[i]
            np.testing.assert_array_equal(runs.q[i], alone.run().q)
        assert len(np.unique(runs.q_end.values.round(9), axis=0)) == ends


def test_a_moved_object_keeps_its_target():
    scene = load().scene
    assert scene.attached("plate", "free_camera.body").object().tag == TAG
    assert scene.believe(place=rs.Pose.at(0.01)).object().tag == TAG


@pytest.mark.parametrize(
    ("new", "told"),
    [
        (f"{TAG_TEXT}\n{BOARD_TEXT}", "objects.plate: tag and board: give one of them only"),
        (f'{TAG_TEXT}\nmarks = ["0, 0, 0 cm"]', "objects.plate: tag and marks: give one of them"),
        ("tag = 7", "objects.plate.tag: must be a table, got 7"),
        (TAG_TEXT.replace("7", "587"), "objects.plate.tag: id of a tag of tag36h11 must be below"),
        (
            TAG_TEXT.replace("36h11", "36h12"),
            "objects.plate.tag.family: must be 'tag16h5', .*'tag36h12'",
        ),
        (
            TAG_TEXT.replace('"8 cm"', "0.08"),
            "objects.plate.tag.size: 0.08: expected one number with a",
        ),
        (TAG_TEXT.replace("8 cm", "-8 cm"), "objects.plate.tag.size: must be greater than 0"),
        ('tag = { family = "tag36h11", id = 7 }', "objects.plate.tag.size: missing"),
        (BOARD_TEXT.replace("20 mm", "4 cm"), "objects.plate.board: tag of 0.04 m: larger than"),
        (BOARD_TEXT.replace("rows", "row"), "objects.plate.board.row: unknown key 'row'; did you"),
    ],
)
def test_each_fault_is_reported_with_its_key(new, told):
    with pytest.raises(rs.errors.FileError, match=told):
        load(new)


@pytest.mark.parametrize(
    ("make", "told"),
    [
        (lambda: rs.Object("plate", tag=7), "tag of 'plate': expected a Tag, got 7"),
        (lambda: rs.Object("plate", board=TAG), "board of 'plate': expected a Board"),
        (lambda: rs.Object("plate", tag=TAG, board=BOARD), "give one of tag and board only"),
        (lambda: rs.Object("plate", tag=TAG, marks=BOARD.marks), "marks and tag36h11_7, which has"),
    ],
)
def test_a_wrong_target_is_refused(make, told):
    with pytest.raises(rs.errors.InputError, match=told):
        make()


def test_figures_show_the_target_also_without_the_extra(monkeypatch):
    """A tag is then a black square; its marks do not need its pattern."""
    monkeypatch.setattr("robsim.vision.tags.tag.find_spec", lambda name: None)
    plate = rs.Object("plate", rs.Block(0.2, 0.2, 0.01), tag=TAG)
    block, paper, *rows = plate.solids
    assert block == plate.shapes[0] and len(rows) == 8 and len(plate.marks) == 4
    ink = np.concatenate([row.vertices[:, :2] for row in rows])
    np.testing.assert_allclose([ink.min(axis=0), ink.max(axis=0)], [[-0.04] * 2, [0.04] * 2])
    np.testing.assert_allclose(np.ptp(paper.vertices, axis=0)[:2], [0.1, 0.1])
