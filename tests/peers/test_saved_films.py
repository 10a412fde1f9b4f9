"""Films that a page saves, opened by PyAV."""

import pytest

from robsim import examples, load_scenario
from robsim.studio.downloads import FILM_FRAMES, build_download

av = pytest.importorskip("av")


@pytest.mark.parametrize("name", ["eye_in_hand", "visp_tutorial"])
def test_a_film_of_a_long_run_has_few_frames(name, tmp_path):
    experiment = load_scenario(examples.path(name))
    (tmp_path / "film.mp4").write_bytes(build_download(experiment, None, "film.mp4")[1])
    with av.open(tmp_path / "film.mp4") as film:
        sizes = [(frame.width, frame.height) for frame in film.decode(video=0)]
    assert 20 < len(sizes) < 2 * FILM_FRAMES and set(sizes) == {(960, 540)}
