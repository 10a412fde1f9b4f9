"""The suite with detectors in pictures: its poster, its perturbation, and who succeeds."""

import numpy as np
import pytest

import robsim as rs
from robsim.suites.published import vit_500, vit_500_images
from robsim.suites.suite_registry import load_quick_suites, load_suite
from robsim.vision import DotDetector, MarkSearch

SUITE = vit_500_images.suite()


def take_ten(scheme):
    """The suite with every 50th start, plain and perturbed, and one scheme."""
    runs = np.flatnonzero(SUITE.draws % 50 == 0)
    return rs.studies.Suite(
        "ten",
        1,
        *(getattr(SUITE, name) for name in ("title", "source", "criterion", "succeeds", "scene")),
        SUITE.goal,
        SUITE.starts[runs],
        varied={name: values[runs] for name, values in SUITE.varied.items()},
        groups={"picture": [SUITE.groups["picture"][i] for i in runs]},
        draws=SUITE.draws[runs],
        dt=SUITE.dt,
        duration=SUITE.duration,
        schemes={scheme: SUITE.schemes[scheme]},
    )


def test_the_dots_of_the_picture_are_where_the_marks_are():
    scene = SUITE.scene
    true = scene.view(SUITE.goal).pixels
    target = scene.object().mark_target
    search = MarkSearch(target, scene.object().marks, scene.camera().camera, np.rint(true)[None])
    found = DotDetector().find(scene.picture(SUITE.goal)[None], search)[0]
    np.testing.assert_allclose(found, true, atol=0.05)


def test_runs_are_the_starts_of_vit_500_twice_and_the_second_time_perturbed():
    assert (SUITE.starts == np.tile(vit_500.suite().starts, (2, 1))).all()
    assert (SUITE.draws == np.tile(np.arange(500), 2)).all()
    card, gain, noise = (x.reshape(2, 500, -1) for x in SUITE.varied.values())
    assert (card[0] == [0, 0, 0.01]).all() and (gain[0] == 1).all() and (noise[0] == 0).all()
    on = card[1, :, 2] < 0
    assert on.sum() == 224 and (noise[1] == 12.75).all()
    edge = np.abs(card[1, on, :2]).max(axis=0) + vit_500_images.CARD / 2
    assert (edge <= [0.4, 0.3]).all() and (edge > [0.39, 0.29]).all()
    assert gain[1].min() == pytest.approx(0.4, abs=0.01)
    assert gain[1].max() == pytest.approx(1.6, abs=0.01)


def test_only_a_name_runs_a_suite_with_pictures():
    assert SUITE.uses_pictures and not load_suite("cns_150").uses_pictures
    quick = {each.name for each in load_quick_suites()}
    assert "cns_150" in quick and not quick & {"vit_500_images", "photometric"}


@pytest.mark.full
def test_dots_lead_from_most_of_ten_starts_to_the_goal():
    table = rs.bench(take_ten("IBVS, dots")).table.set_index("group")
    assert table.loc[["plain", "perturbed"], "runs"].tolist() == [10, 10]
    assert table.loc[["plain", "perturbed"], "successes"].tolist() == [8, 7]
