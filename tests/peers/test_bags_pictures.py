"""A bag contains the pictures of its experiment."""

import shutil

from pictures.test_stored_pictures import write_scenario

import robsim as rs


def test_a_bag_contains_the_pictures_of_its_experiment(tmp_path):
    cell = rs.load_scenario(write_scenario(tmp_path / "here"))
    path = rs.logs.write_bag(cell.run(), tmp_path / "run.mcap")
    shutil.rmtree(tmp_path / "here")
    assert rs.Experiment.of(rs.logs.read_bag(path)).scene == cell.scene
