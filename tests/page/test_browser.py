"""A page in a real browser: the drawing, and the effect of the controls."""

import io
import re

import numpy as np
import pytest
from page.waiting import until

import robsim as rs
from robsim.page.export import embed_page, export_html

pytestmark = pytest.mark.browser
FRAME = "robsim.space.frames.find((f) => f.name === '{}')"


def picture(page, of="#space"):
    """The pixels (height, width, 3) of an element as it is drawn."""
    from matplotlib.image import imread

    page.wait_for_timeout(150)
    if of == "#space":
        until(page, "!robsim.space.dirty && robsim.space.sharpness === 1")
    return imread(io.BytesIO(page.locator(of).screenshot()), format="png")[..., :3]


def position(page, frame="camera"):
    return page.evaluate(f"{FRAME.format(frame)}.position.toArray()")


def test_the_arm_stands_where_the_run_has_it(opened, demo_page):
    page = opened(demo_page.as_uri())
    scene = rs.load_scenario(rs.examples.path("chapter_6_1"))
    run, T = scene.run(), scene.scene.display.matrix
    for index in (0, 60, round(float(run.end_time) / 0.04)):
        page.evaluate(f"robsim.clock.step({index} - robsim.clock.index)")
        true = (T @ scene.scene.pose("camera", run.q.values[index]).matrix)[:3, 3]
        assert np.abs(np.array(position(page)) - true).max() < 1e-4
        assert page.locator("#seconds").inner_text() == f"{index * 0.04:.2f} s"


def test_pictures_are_drawn_on_their_faces(opened, tmp_path):
    """Each square has the grey value of its place on the face, and is seen from outside."""
    grey = np.array([[0, 60, 120], [160, 200, 255]], dtype=np.uint8)
    pictures = rs.shapes.BlockPictures(top=grey, left=grey)
    shapes = rs.shapes.Poster(grey, 0.6), rs.shapes.Block(0.4, 0.2, 0.1, pictures=pictures)
    things = [rs.Object(name, shape) for name, shape in zip("ab", shapes, strict=True)]
    page = opened(export_html(rs.Scene(objects=things), tmp_path / "pictures.html").as_uri())
    for name, shape in zip("ab", shapes, strict=True):
        drawn = f"{FRAME.format(name)}.children.filter((n) => n.material.vertexColors)"
        for k, (number, face) in enumerate(shape.face_pictures.items()):
            geometry = f"{drawn}[{k}].geometry.attributes"
            points, light = (
                np.reshape(page.evaluate(f"Array.from({geometry}.{each}.array)"), (6, 6, 3))
                for each in ("position", "color")
            )
            places = face.texel @ np.column_stack([points.mean(axis=1), np.ones(6)]).T
            columns, rows = np.floor(places).astype(int)
            assert sorted(3 * rows + columns) == [0, 1, 2, 3, 4, 5]
            srgb = np.where(light < 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
            assert abs(255 * srgb - grey[rows, columns][:, None, None]).max() < 0.01
            corners = shape.vertices[list(shape.faces[number])]
            outward = np.cross(corners[1] - corners[0], corners[2] - corners[1])
            sides = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 1])
            assert (sides @ outward > 0).all()


def test_round_parts_are_smooth_and_have_lines_where_they_have_edges(opened, tmp_path):
    """Normals at the corners of triangles equal the true surface normals; a capsule has no line."""
    shapes = (
        rs.shapes.Capsule(0.1, 0.3),
        rs.Wheel(0.1, 0.2, n=32),
        rs.Block(1, 1, 1),
        rs.Wheel(1, 1, n=6),
    )
    things = [rs.Object(name, shape) for name, shape in zip("abcd", shapes, strict=True)]
    page = opened(export_html(rs.Scene(objects=things), tmp_path / "round.html").as_uri())
    found = {}
    for name in "abcd":
        mesh, lines = (f"{FRAME.format(name)}.children[{i}].geometry.attributes" for i in (0, 1))
        read = [f"{mesh}.position", f"{mesh}.normal", f"{lines}.position"]
        found[name] = [
            np.reshape(page.evaluate(f"Array.from({each}.array)"), (-1, 3)) for each in read
        ]
    points, normals, lines = found["a"]
    away = points - np.clip(points, [0, 0, -0.15], [0, 0, 0.15])
    assert (np.sum(normals * away, axis=1) > 0.1 * np.cos(np.radians(3))).all()
    assert len(lines) == 0
    points, normals, lines = found["b"]
    flat = np.abs(normals[:, 2]) > 0.5
    radial = points[~flat] * (10, 10, 0)
    assert (np.sum(normals[~flat] * radial, axis=1) > np.cos(np.radians(3))).all()
    assert np.abs(normals[flat, 2]).min() > 1 - 1e-6 and len(lines) == 2 * 2 * 32
    for name, count in (("c", 12), ("d", 12)):  # sides that bend by 90 and 60 degrees stay flat
        normals = found[name][1].reshape(-1, 3, 3)
        assert np.abs(np.diff(normals, axis=1)).max() < 1e-6
        assert len(found[name][2]) == 2 * count


def test_slider_curve_speed_and_keys_go_through_the_run(opened, demo_page):
    page = opened(demo_page.as_uri())
    before = picture(page)
    page.locator("#slider").fill("150")
    after = picture(page)
    assert before.std() > 0.05 and (np.abs(after - before).max(axis=2) > 0.1).mean() > 0.005
    page.locator("#slider").fill("0")
    assert np.abs(picture(page) - before).max() < 0.02
    box = page.locator("#charts .u-over").first.bounding_box()
    page.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    assert abs(page.evaluate("robsim.clock.seconds / robsim.clock.end") - 0.5) < 0.02
    page.keyboard.press("Home")
    page.locator("#speed").select_option("4")
    pass_time = "robsim.clock.playing = true; robsim.clock.pass(0.5); robsim.clock.playing = false"
    page.evaluate(f"robsim.clock.pass(0); {pass_time}")
    assert page.evaluate("robsim.clock.seconds") >= 2.0
    page.locator("#speed").select_option("1")
    page.locator("h1").click()  # takes the focus from the choice of a speed
    for key, index in (("Home", 0), ("ArrowRight", 1), ("Shift+ArrowRight", 11), ("ArrowLeft", 10)):
        page.keyboard.press(key)
        assert page.evaluate("robsim.clock.index") == index
    page.keyboard.press(" ")
    until(page, "robsim.clock.index > 15")
    page.keyboard.press(" ")
    there = page.evaluate("robsim.clock.index")
    page.wait_for_timeout(200)
    assert page.evaluate("robsim.clock.index") == there


def test_ghosts_are_shown_and_hidden(opened, tmp_path):
    run = rs.load_scenario(rs.examples.path("wrong_dh")).run()
    page = opened(export_html(run, tmp_path / "run.html").as_uri())
    with_ghost = picture(page)
    page.locator(".lil-gui .lil-title").click()
    page.locator(".lil-gui .lil-name", has_text=re.compile("^belief$")).click()
    page.locator(".lil-gui .lil-title").click()
    page.wait_for_timeout(400)
    assert (np.abs(picture(page) - with_ghost).max(axis=2) > 0.05).mean() > 0.001


def test_dark_and_light_are_both_readable(opened, demo_page):
    for scheme in ("light", "dark"):
        page = opened(demo_page.as_uri(), color_scheme=scheme)
        texts = page.locator("h1, #outcome, figcaption, summary, #seconds")
        for style in texts.evaluate_all("all => all.map(e => getComputedStyle(e).color)"):
            paper = page.evaluate("getComputedStyle(document.body).backgroundColor")
            assert contrast(style, paper) > 4.5


def contrast(*colors):
    """The contrast of two colours by the rule of WCAG 2."""
    light = []
    for color in colors:
        rgb = np.array([int(n) for n in re.findall(r"\d+", color)[:3]]) / 255
        linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
        light.append(linear @ (0.2126, 0.7152, 0.0722) + 0.05)
    return max(light) / min(light)


def test_a_phone_shows_everything_one_below_the_other(opened, demo_page):
    page = opened(demo_page.as_uri(), viewport={"width": 390, "height": 844}, has_touch=True)
    parts = ["#space", "#pictures canvas", "#charts figure:last-child", "footer"]
    for box in (page.locator(part).first.bounding_box() for part in parts):
        assert box["x"] >= 0 and box["x"] + box["width"] <= 390 and box["height"] > 20
    assert page.evaluate("document.documentElement.scrollWidth") <= 390


def test_it_plays_at_once_unless_motion_is_unwanted(opened, demo_page):
    page = opened(demo_page.as_uri(), reduced_motion="no-preference")
    until(page, "robsim.clock.index > 3")


def test_a_title_with_script_is_text(opened, tmp_path):
    bad = "<img src=x onerror=alert(1)></script><script>document.title='ran'</script>"
    experiment = rs.load_scenario(rs.examples.path("visp_tutorial")).with_(title=bad)
    page = opened(export_html(experiment.run(duration=0.4), tmp_path / "run.html").as_uri())
    assert page.locator("h1").inner_text() == bad and page.title() == bad


def test_a_damaged_page_reports_it(opened, demo_page, tmp_path):
    text = demo_page.read_text()
    at = text.index('id="recording">') + 500
    (tmp_path / "bad.html").write_text(text[:at] + "AAAA" + text[at + 4 :])
    page = opened((tmp_path / "bad.html").as_uri())
    assert "cannot be shown" in page.locator("#problem").inner_text()


def test_it_lives_in_a_frame_of_a_notebook(opened, demo_page, tmp_path):
    (tmp_path / "notebook.html").write_text(
        f"<body data-ready=1>{embed_page(demo_page.read_text())}"
    )
    page = opened((tmp_path / "notebook.html").as_uri())
    frame = page.frame_locator("iframe")
    frame.locator("body[data-ready=yes]").wait_for()
    assert "6.1" in frame.locator("h1").inner_text()


def test_a_notebook_shows_a_run_also_once_it_is_a_page_of_its_own(chromium, tmp_path):
    import nbformat
    from nbconvert import HTMLExporter
    from nbconvert.preprocessors import ExecutePreprocessor

    code = "import robsim as rs\nrs.load_scenario(rs.examples.path('visp_tutorial')).run()"
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(code)])
    ExecutePreprocessor(timeout=120, kernel_name="python3").preprocess(notebook, {})
    html, _ = HTMLExporter(template_name="basic").from_notebook_node(notebook)
    (tmp_path / "notebook.html").write_text(html)
    page = chromium.new_page(offline=True, reduced_motion="reduce")
    page.goto((tmp_path / "notebook.html").as_uri())
    frame = page.frame_locator("iframe")
    frame.locator("body[data-ready=yes]").wait_for()
    assert frame.locator("h1").inner_text() == "ViSP's tutorial case"
    page.context.close()


def test_firefox_draws_it_too(firefox, demo_page):
    from matplotlib.image import imread

    shot = firefox(demo_page.as_uri(), "document.body.dataset.ready === 'yes'")
    assert imread(io.BytesIO(shot))[100:500, 50:850, :3].std() > 0.05


def test_without_graphics_the_image_and_the_curves_are_left(chromium_flat, demo_page):
    page = chromium_flat(demo_page.as_uri())
    assert "cannot draw in 3-D" in page.locator("#space").inner_text()
    page.locator("#slider").fill("100")
    assert page.locator("#seconds").inner_text() == "4.00 s"
    assert picture(page, "#pictures canvas").std() > 0.05
