"""The gallery of a studio in a real browser: groups, pictures, search and keys."""

import pytest
from page.desk import open_desk
from page.waiting import until

import robsim as rs
from robsim.files.example_groups import GROUPS
from robsim.studio.scenario_shelf import ScenarioShelf

pytestmark = pytest.mark.browser
PAINTED = (
    "[...document.querySelectorAll('#gallery img')].filter((i) => i.naturalWidth === 320).length"
)


def names(page):
    return page.locator(".card:visible").evaluate_all("all => all.map((c) => c.dataset.name)")


def has_words(text, words):
    return all(word in text.lower() for word in words.lower().split())


def test_every_experiment_has_a_card_in_its_group_and_a_search_finds_it(desk):
    page = desk.page()
    page.locator("#choose").click()
    assert names(page) == [name for group in GROUPS.values() for name in group]
    assert page.locator("#gallery h3").all_inner_texts() == list(GROUPS)
    until(page, f"{PAINTED} === {len(rs.examples.names())}")
    entries = ScenarioShelf.shipped().entries
    texts = {e["name"]: f"{e['name']} {e['title']} {e['about']} {e['more']}" for e in entries}
    for words in ("retreat", "PUMA wrong", "task.interaction=mean", "zebra", ""):
        page.locator("#gallery input").fill(words)
        expected = [name for name, text in texts.items() if has_words(text, words)]
        assert names(page) == expected, words
        assert page.locator("#gallery .none").is_visible() == (not expected)
    page.locator("#gallery input").fill("retreat")
    assert {"camera_retreat", "retreat_cures"} <= set(names(page)) and len(names(page)) < 6


def test_keys_choose_an_experiment(desk):
    page = desk.page()
    page.locator("#choose").click()
    page.keyboard.press("ArrowDown")
    focused = "document.activeElement.dataset.name"
    first, second, *_ = names(page)
    assert page.evaluate(focused) == first
    page.keyboard.press("ArrowRight")
    assert page.evaluate(focused) == second
    page.keyboard.press("ArrowDown")
    assert page.evaluate(focused) in GROUPS["Schemes compared"]
    page.keyboard.press("ArrowUp")
    assert page.evaluate(focused) == second
    assert page.evaluate("robsim.state.playing") is False  # the keys of the page rest
    page.keyboard.press("Enter")
    until(page, "document.getElementById('title').innerText.includes('section 6.1')")
    page.locator("#choose").click()
    page.keyboard.type("car drives up")
    page.keyboard.press("Enter")
    until(page, "document.getElementById('title').innerText.includes('car')")
    page.locator("#choose").click()
    page.keyboard.press("Escape")
    assert not page.locator("#gallery").is_visible()


def test_a_phone_has_one_column(desk):
    page = desk.page(viewport={"width": 390, "height": 844})
    page.locator("#choose").click()
    left = page.locator(".card:visible").evaluate_all(
        "all => all.map((c) => c.getBoundingClientRect().left)"
    )
    assert len(set(left)) == 1
    assert page.locator("#gallery").evaluate("(dialog) => dialog.scrollWidth") <= 390


def test_a_folder_has_cards_with_initials(chromium, tmp_path):
    text = rs.load_scenario(rs.examples.path("visp_tutorial")).text
    for name in ("one", "two"):
        (tmp_path / f"{name}.toml").write_text(f"# Watch {name}.\n{text}")
    shelf = ScenarioShelf.of(tmp_path)
    with open_desk(chromium, shelf.first(), shelf) as desk:
        page = desk.page()
        page.locator("#choose").click()
        assert names(page) == ["one", "two"] and page.locator("#gallery h3").count() == 0
        assert page.locator("#gallery .initial").all_inner_texts() == ["V", "V"]
