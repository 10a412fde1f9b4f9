"""Pages of all shipped experiments, each with a picture that stands behind it in a text."""

import json
import multiprocessing
import shutil
import warnings
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from experiment_pictures import draw_image, draw_scene
from PIL import Image

import robsim as rs
from robsim.page import load_recording
from robsim.studio.scenario_shelf import ScenarioShelf

CARDS = "experiments.json"
SIZE = (960, 540)  # pixels of a poster
SCENE, IMAGE = (576, 540), (384, 540)  # its parts
QUALITY = 70  # of WebP
WORKERS = 2


@dataclass(frozen=True)
class LiveExperiment:
    """A shipped experiment whose page stands in the folder of live pages."""

    name: str
    title: str
    about: str
    group: str
    ending: str
    arrived: bool
    mission: bool

    @property
    def picture_text(self) -> str:
        """The alternative text of its picture."""
        shown = "Scene" if self.mission else "Scene and camera image"
        return f"{shown} of the experiment: {self.title}"


def build_experiments(folder: Path) -> list[LiveExperiment]:
    """Run all shipped experiments, and write their pages, pictures and cards into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    entries = ScenarioShelf.shipped().entries
    spawn = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(WORKERS, mp_context=spawn) as pool:
        cards = list(pool.map(build_experiment, [folder] * len(entries), entries))
    text = json.dumps([asdict(card) for card in cards], indent=1)
    (folder / CARDS).write_text(text, encoding="utf-8")
    return cards


def copy_experiments(source: Path, folder: Path) -> list[LiveExperiment]:
    """Copy the live pages of an earlier build, and return their cards."""
    if source.resolve() != folder.resolve():
        shutil.copytree(source, folder, dirs_exist_ok=True)
    cards = json.loads((folder / CARDS).read_text(encoding="utf-8"))
    return [LiveExperiment(**card) for card in cards]


def build_experiment(folder: Path, entry: dict[str, str]) -> LiveExperiment:
    """Run an experiment, write its page and its picture, and return its card."""
    name = entry["name"]
    experiment = ScenarioShelf.shipped().experiment(name)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        # some experiments demonstrate a loss of rank
        warnings.simplefilter("ignore", rs.errors.RankWarning)
        run = experiment.run()
    page = load_recording(rs.export_html(run, folder / f"{name}.html")).header
    draw_poster(experiment, run).save(folder / f"{name}.webp", "WEBP", quality=QUALITY)
    arrived = page["outcome"] == rs.Outcome.CONVERGED.name
    ending = page["events"][-1]["text"]
    texts = (name, entry["title"], entry["about"], entry["group"], ending)
    return LiveExperiment(*texts, arrived, isinstance(run, rs.tasks.MissionRun))


def draw_poster(experiment: rs.Experiment, run: Any) -> Image.Image:
    """Return the scene beside the image; of a mission the scene alone."""
    poster = Image.new("RGB", SIZE, "white")
    if isinstance(run, rs.tasks.MissionRun):
        poster.paste(draw_scene(experiment, run, SIZE), (0, 0))
        return poster
    poster.paste(draw_scene(experiment, run, SCENE), (0, 0))
    poster.paste(draw_image(run, IMAGE), (SCENE[0], 0))
    return poster
