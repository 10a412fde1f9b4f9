"""Films: the content of each frame is compared with the run, and files are read back."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest
from matplotlib.text import Text
from PIL import Image

import robsim as rs
from robsim.cli.page_and_films import check_views
from robsim.page import load_recording
from robsim.plot.film.animation import PAUSE
from robsim.plot.film.film_frames import FilmFrames
from robsim.plot.film.film_source import build_film_source
from robsim.plot.film.frame_times import LONGEST, MOST, choose_frame_times
from robsim.plot.shaded_solids import SolidFaces

LOOK = {"view": None, "goal": None, "title": None}
SMALL = {"dpi": 25}  # 320 x 180 pixels


def example(name, **changes):
    return rs.load_scenario(rs.examples.path(name)).with_(**changes)


def screen_of(run, fps=4.0, speed=None, **look):
    footage = build_film_source(run)
    return FilmFrames(
        footage, choose_frame_times(footage.time, fps, speed), (12.8, 7.2), 50.0, **LOOK | look
    )


@pytest.fixture(scope="module")
def arm():
    return example("chapter_6_1", duration=1.0).run()


@pytest.fixture(scope="module")
def short():
    return example("visp_tutorial", duration=0.4).run()


@pytest.fixture(scope="module")
def mission():
    return example("inspection_a").run()


def read_gif(run, path, **how):
    """The pictures (H, W, 3) of a GIF as any reader shows them, and their milliseconds."""
    pictures, spans = [], []
    with Image.open(rs.plot.save_film(run, path, **SMALL | how)) as film:
        assert film.info["loop"] == 0  # for ever
        for k in range(film.n_frames):
            film.seek(k)
            pictures.append(np.asarray(film.convert("RGB")).astype(int))
            spans.append(film.info["duration"])
    return pictures, spans


# ---- time ----


@pytest.mark.full
@pytest.mark.parametrize(
    ("fps", "speed", "frames"), [(8, 0.5, 17), (7, 3, 4), (8, 2, 5), (3, 1, 4)]
)
def test_the_number_of_frames_follows_from_rate_and_speed(arm, tmp_path, fps, speed, frames):
    pictures, spans = read_gif(arm, tmp_path / "run.gif", fps=fps, speed=speed)
    assert len(pictures) == frames
    assert sum(spans) == 10 * round(100 * (frames / fps + PAUSE))
    assert all(abs(span - 1000 / fps) <= 10 for span in spans[:-1])
    assert abs(spans[-1] - 1000 * (1 / fps + PAUSE)) <= 10


def test_each_frame_shows_the_nearest_instant_and_the_last_one_the_end():
    time = np.arange(251) * 0.04
    found = choose_frame_times(time, 12.0, 1.5).instants
    wanted = np.minimum(np.arange(81) * 1.5 / 12, 10.0)
    away = np.abs(time - wanted[:, None])
    np.testing.assert_allclose(np.abs(time[found] - wanted), away.min(axis=1), atol=1e-12)
    assert found[-1] == 250


def test_ten_thousand_instants_are_a_film_of_a_minute():
    found = choose_frame_times(np.arange(10_000) * 0.04, 20.0, None)
    assert found.speed == 7 and len(found.instants) == np.ceil(399.96 / 7 * 20) + 1
    assert len(found.instants) <= 20 * LONGEST + 1
    assert choose_frame_times(np.arange(5) * 0.04, 20.0, None).speed == 1


def test_an_instant_alone_is_a_film_of_one_frame(tmp_path):
    start = example("visp_tutorial")
    away = start.with_(start=np.r_[3.0, 0, -0.5, start.start[3:]])
    run = away.run()
    assert rs.Outcome(int(run.outcome)) is rs.Outcome.BEHIND_CAMERA and float(run.end_time) == 0
    assert read_gif(run, tmp_path / "run.gif")[1] == [10 * round(100 * (1 / 20 + PAUSE))]


@pytest.mark.full
def test_the_time_after_the_end_of_a_run_is_not_filmed():
    run = example("visp_tutorial").run()
    assert np.isnan(run.error_norm.values[-1])
    footage = build_film_source(run)
    assert footage.time[-1] == float(run.end_time)
    screen = screen_of(run, fps=1.0)
    screen[len(screen) - 1]
    assert read_time_line(screen) == f"converged after 20.4 s     t = {float(run.end_time):.2f} s"


# ---- the picture ----


def read_time_line(screen):
    """The line that changes from frame to frame."""
    [text] = [t for t in screen.figure.findobj(Text) if t.get_text().endswith(" s")]
    return text.get_text()


def dots(axes):
    """(N, 2) where circles are drawn."""
    circles = [line for line in axes.get_lines() if line.get_marker() == "o"]
    return np.concatenate([line.get_xydata() for line in circles if line.get_visible()])


def test_marks_are_the_pixels_of_the_run_in_each_frame(arm):
    screen = screen_of(arm, fps=5.0)
    for k, instant in enumerate(screen.clock.instants):
        screen[k]
        np.testing.assert_array_equal(dots(screen.figure.axes[1]), arm.pixels.values[instant])
        assert read_time_line(screen).endswith(f"t = {float(arm.time[instant]):.2f} s")


@pytest.mark.full
def test_two_cameras_have_an_image_each():
    run = example("stereo_in_hand", duration=0.4).run()
    screen = screen_of(run)
    screen[1]
    instant = screen.clock.instants[1]
    for axes, camera in zip(screen.figure.axes[1:3], ("left", "right"), strict=True):
        mine = run.pixels.values[instant][run.mark_camera.values == camera]
        np.testing.assert_array_equal(dots(axes), mine)
        assert axes.get_title() == camera


def faces(figure):
    [solids] = [a for a in figure.axes[0].collections if isinstance(a, SolidFaces)]
    return solids


@pytest.mark.full
@pytest.mark.parametrize("name", ["chapter_6_1", "eye_to_hand", "differential_drive"])
def test_solids_stand_and_are_lit_as_in_a_figure_of_that_moment(name):
    experiment = example(name, duration=1.0)
    run = experiment.run()
    screen = screen_of(run, fps=2.0)
    for k, instant in enumerate(screen.clock.instants):
        screen[k]
        wanted = faces(rs.plot.scene(experiment.scene, run.q.values[instant]))
        np.testing.assert_allclose(faces(screen.figure)._faces, wanted._faces, atol=1e-12)
        lit, as_lit = faces(screen.figure)._facecolor3d, wanted._facecolor3d
        np.testing.assert_allclose(lit, as_lit, atol=1e-9)


def test_curves_are_drawn_until_now(arm):
    screen = screen_of(arm, fps=5.0)
    screen[2]
    instant = int(screen.clock.instants[2])
    v = screen.figure.axes[2]
    now = float(arm.time[instant])
    grown = [line.get_xydata() for line in v.get_lines() if len(line.get_xdata()) == instant + 1]
    assert len(grown) == 3
    for i, line in enumerate(grown):
        np.testing.assert_array_equal(line[:, 0], arm.time.values[: instant + 1])
        np.testing.assert_array_equal(line[:, 1], arm.camera_velocity.values[: instant + 1, i])
    assert [now, now] in [list(line.get_xdata()) for line in v.get_lines()]


def test_with_a_camera_at_rest_the_velocity_agrees_with_the_target():
    screen = screen_of(example("eye_to_hand", duration=0.4).run())
    assert screen.figure.axes[2].get_ylabel().startswith("v of puma560.flange")


def placement(screen):
    """All data on the positions of drawings, of all axes."""
    for axes in screen.figure.axes:
        limits = [getattr(axes, f"get_{n}lim")() for n in "xyz" if hasattr(axes, f"get_{n}lim")]
        seen = axes.get_proj().tolist() if hasattr(axes, "get_proj") else ()
        yield limits, seen, axes.get_position().bounds


@pytest.mark.full
@pytest.mark.parametrize("name", ["chapter_6_1", "differential_drive", "stereo_in_hand"])
def test_axes_view_and_ground_are_the_same_in_all_frames(name):
    screen = screen_of(example(name, duration=2.0).run())
    first = screen[0]
    before = list(placement(screen))
    edges = [first[:, :2], first[-40:]]  # labels of axes
    for k in range(1, len(screen)):
        now = screen[k]
        assert list(placement(screen)) == before
        for edge, part in zip(edges, (now[:, :2], now[-40:]), strict=True):
            np.testing.assert_array_equal(part[:, :24], edge[:, :24])
    np.testing.assert_array_equal(screen[0], first)  # nothing drawn since is left


@pytest.mark.full
def test_everything_stays_inside_of_the_box_of_the_scene(arm):
    screen = screen_of(arm, fps=10.0)
    axes = screen.figure.axes[0]
    low, high = np.transpose([axes.get_xlim(), axes.get_ylim(), axes.get_zlim()])
    for k in range(len(screen)):
        screen[k]
        corners = faces(screen.figure)._faces
        assert (corners >= low - 1e-9).all() and (corners <= high + 1e-9).all()


def test_a_view_and_a_title_are_obeyed(short):
    screen = screen_of(short, view=(40, 10), title="Mine")
    assert (screen.figure.axes[0].elev, screen.figure.axes[0].azim) == (40, 10)
    assert screen.figure.get_suptitle() == "Mine"


@pytest.mark.full
def test_a_mission_shows_its_phases_and_its_camera_where_it_is_used(mission):
    screen = screen_of(mission, fps=1.0)
    time = mission.run.time.values
    for k, instant in enumerate(screen.clock.instants[:-1]):
        screen[k]
        leg = mission.legs[
            np.searchsorted([leg.start for leg in mission.legs], time[instant] + 1e-9) - 1
        ]
        assert read_time_line(screen) == f"{leg.name}     t = {time[instant]:.2f} s"
        [idle] = [t for t in screen.figure.axes[1].texts if t.get_text() == "not in use"]
        assert idle.get_visible() == (leg.name != "approach by sight")
        if not idle.get_visible():
            at = round((time[instant] - leg.start) / 0.04)
            np.testing.assert_array_equal(dots(screen.figure.axes[1]), leg.run.pixels.values[at])
    screen[len(screen) - 1]
    assert read_time_line(screen).startswith("all phases as expected")


# ---- files ----


@pytest.mark.full
def test_a_gif_has_the_frames_that_were_drawn(arm, tmp_path):
    pictures, _ = read_gif(arm, tmp_path / "run.gif", fps=5, size=(12.8, 7.2), dpi=50)
    screen = screen_of(arm, fps=5.0)
    assert pictures[0].shape == (360, 640, 3)
    for k, picture in enumerate(pictures):
        away = np.abs(picture - screen[k][..., :3])
        assert away.mean() < 0.5 and (away.max(axis=2) > 40).mean() < 1e-3
        white = (screen[k][..., :3] == 255).all(axis=2)
        assert (picture[white] == 255).all() and white.mean() > 0.5


@pytest.mark.full
def test_the_same_run_gives_the_same_bytes(arm, tmp_path):
    one, other = (rs.plot.save_film(arm, tmp_path / name, fps=5) for name in ("a.gif", "b.gif"))
    assert one.read_bytes() == other.read_bytes()


@pytest.mark.full
def test_a_film_of_the_demo_is_small(tmp_path):
    run = example("chapter_6_1").run()
    assert rs.plot.save_film(run, tmp_path / "run.gif").stat().st_size < 3e6


@pytest.mark.browser
def test_an_mp4_has_the_frames_that_were_drawn(arm, tmp_path):
    import av

    screen = screen_of(arm, fps=5.0)
    with av.open(rs.plot.save_film(arm, tmp_path / "run.mp4", fps=5, dpi=50)) as film:
        stream = film.streams.video[0]
        assert stream.average_rate == 5 and stream.codec_context.name == "h264"
        pictures = [frame.to_ndarray(format="rgb24").astype(int) for frame in film.decode(stream)]
    assert len(pictures) == len(screen) + round(5 * PAUSE)
    for k, picture in enumerate(pictures):
        assert np.abs(picture - screen[min(k, len(screen) - 1)][..., :3]).mean() < 3


def test_folders_are_made_and_progress_reported(short, tmp_path):
    shares = []
    path = rs.plot.save_film(
        short, tmp_path / "a" / "run.GIF", **SMALL, fps=10, progress=shares.append
    )
    assert path.stat().st_size > 1000 and shares == [0.2, 0.4, 0.6, 0.8, 1.0]


def test_a_stop_keeps_the_old_file(short, tmp_path):
    def stop(share):
        if share > 0.3:
            raise KeyboardInterrupt

    path = tmp_path / "run.gif"
    path.write_text("old")
    with pytest.raises(KeyboardInterrupt):
        rs.plot.save_film(short, path, **SMALL, progress=stop)
    assert [each.read_text() for each in tmp_path.iterdir()] == ["old"]


BAD = {
    "no rate": ({"fps": 0}, "fps"),
    "a negative rate": ({"fps": -1}, "fps"),
    "too many frames a second": ({"fps": 51}, r"a \.gif has 0.1 to 50 frames a second, got 51"),
    "a negative speed": ({"speed": -2}, "speed"),
    "no speed": ({"speed": 0}, "speed"),
    "a word": ({"speed": "fast"}, "speed"),
    "NaN": ({"fps": float("nan")}, "fps"),
    "too many frames": ({"speed": 1e-4}, f"frames, and a film has at most {MOST}"),
    "a size that is none": ({"size": (0, 1)}, "size"),
    "too little room": ({"size": (4, 3)}, "size: 4 x 3 inches are too few .* reduce dpi"),
    "too many pixels": ({"dpi": 1000}, "64 to 4096 pixels a side"),
    "too few pixels": ({"dpi": 4}, "64 to 4096 pixels a side"),
    "a view that is none": ({"view": 3}, "view"),
    "progress that is no function": ({"progress": 3}, "progress: expected a function"),
    "another experiment": ({"experiment": 3}, "expected an Experiment"),
}


@pytest.mark.parametrize(("how", "message"), BAD.values(), ids=BAD)
def test_a_film_that_is_impossible_is_refused_at_once(short, tmp_path, how, message):
    with pytest.raises(rs.errors.InputError, match=message):
        rs.plot.save_film(short, tmp_path / "run.gif", **how)
    assert not list(tmp_path.iterdir())


def test_paths_of_no_film_are_refused(short, tmp_path):
    for path in (tmp_path / "run.avi", "run", ".gif"):
        with pytest.raises(rs.errors.InputError, match=r"a film ends in \.gif or \.mp4"):
            rs.plot.save_film(short, path)
    (tmp_path / "folder.gif").mkdir()
    with pytest.raises(rs.errors.FileError, match="it is a folder"):
        rs.plot.save_film(short, tmp_path / "folder.gif")
    with pytest.raises(rs.errors.FileError, match="cannot write"):
        rs.plot.save_film(short, "a\0b.gif")


def test_batches_summaries_and_other_things_are_refused(tmp_path):
    experiment = example("visp_tutorial", duration=0.4)
    several = experiment.with_(start=np.tile(experiment.start, (3, 1))).run()
    with pytest.raises(
        rs.errors.InputError, match=r"expected one run, got 3: pick one, as in run\.isel\(run=0\)"
    ):
        rs.plot.save_film(several, tmp_path / "run.gif")
    assert rs.plot.save_film(several.isel(run=1), tmp_path / "run.gif", **SMALL).exists()
    with pytest.raises(rs.errors.InputError, match="only the end of this run was recorded"):
        rs.plot.save_film(experiment.run(record="summary"), tmp_path / "a.gif")
    with pytest.raises(rs.errors.InputError, match="expected a run"):
        rs.plot.save_film(experiment.scene, tmp_path / "a.gif")
    with pytest.raises(rs.errors.InputError, match="belongs to another scene"):
        rs.plot.save_film(several.isel(run=0), tmp_path / "a.gif", example("chapter_6_1"))


# ---- commands ----


def without_av(monkeypatch):
    found = importlib.util.find_spec
    monkeypatch.setattr(
        "robsim.plot.film.mp4.find_spec", lambda name: None if name == "av" else found(name)
    )


def test_an_mp4_without_pyav_is_refused_before_anything_runs(called, monkeypatch, tmp_path, short):
    without_av(monkeypatch)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(
        rs.errors.InputError, match=r"pip install 'robsim\[film\]'.* does not need it"
    ):
        rs.plot.save_film(short, "run.mp4")
    status, out, err = called("run", str(rs.examples.path("visp_tutorial")), "--mp4")
    assert status == 2 and not out and "an MP4 needs PyAV, which is not installed" in err
    assert not list(tmp_path.iterdir())


@pytest.mark.full  # as a film is drawn
def test_run_writes_a_page_and_a_film_beside_the_rest(called, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    command = ["run", str(rs.examples.path("visp_tutorial")), "-o", "out", "--no-figures"]
    short = ["--set", "run.duration=0.4 s"]
    assert called(*command, *short, "--html", "--gif")[0] == 0
    names = ["run.gif", "run.html", "run.nc", "scenario.toml"]
    assert sorted(path.name for path in Path("out").iterdir()) == names
    run = rs.open_run("out/run.nc")
    case = rs.load_scenario(rs.examples.path("visp_tutorial")).at("run.duration", 0.4)
    again = rs.export_html(run, "again.html", case)  # the remark of the file is in the page
    assert Path("out/run.html").read_bytes() == again.read_bytes()
    assert Path("out/run.gif").read_bytes() == rs.plot.save_film(run, "again.gif").read_bytes()
    assert called(*command, *short, "--force")[0] == 0  # films of another run go
    assert sorted(path.name for path in Path("out").iterdir()) == ["run.nc", "scenario.toml"]


def test_a_film_that_is_impossible_is_refused_before_it_is_simulated(called, tmp_path):
    where = tmp_path / "out"
    command = ["run", str(rs.examples.path("visp_tutorial")), "-o", str(where)]
    status, _, err = called(*command, "--gif", "--set", "run.record=summary")
    assert status == 2 and "run.gif shows all instants of a run" in err and not where.exists()
    several = example("visp_tutorial")
    several = several.with_(start=np.tile(several.start, (3, 1)))
    with pytest.raises(rs.errors.InputError, match=r"run\.html shows one run, and .* has 3 starts"):
        check_views(several, ("run.html",))


def test_export_writes_a_film_of_what_the_camera_of_a_stored_run_saw(called, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    run = example("stereo_in_hand").run(duration=0.04)
    rs.save_run(run, "run.nc")
    status, out, _ = called("export", "run.nc", "eye.gif", "--camera", "right")
    assert (status, out) == (0, "wrote eye.gif\n")
    again = rs.plot.save_film(run, "again.gif", camera="right")
    assert Path("eye.gif").read_bytes() == again.read_bytes()
    for options, reason in {
        ("eye.gif", "--camera", "right"): "eye.gif exists; overwrite it with --force",
        ("page.html", "--camera", "right"): "--camera is for films, and page.html is a page",
        ("other.gif", "--camera", "none"): "run.nc: no camera 'none'",
    }.items():
        status, out, err = called("export", "run.nc", *options)
        assert status == 2 and not out and reason in err
    assert not Path("page.html").exists() and not Path("other.gif").exists()
    case = str(rs.examples.path("visp_tutorial"))
    status, _, err = called("export", case, "case.gif")
    assert status == 2 and "expected a run as simulate returns it" in err


@pytest.mark.parametrize(("seen", "options"), [(True, []), (True, ["--no-open"]), (False, [])])
@pytest.mark.few(1)
def test_the_demo_is_live_where_a_person_sees_it(called, monkeypatch, tmp_path, seen, options):
    served = []
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("robsim.page.export.has_browser", lambda: seen)
    monkeypatch.setattr(
        "robsim.cli.demo_command.serve_studio", lambda *given, **how: served.append((given, how))
    )
    status, out, _ = called("demo", *options)
    assert status == 0
    line = "see it move  open robsim-demo/run.html in any browser\n"
    if seen and not options:
        assert served == [((example("chapter_6_1"),), {"once": True})] and line not in out
    else:
        assert not served and out.endswith(line)
    assert load_recording("robsim-demo/run.html").header["outcome"] == "CONVERGED"
