"""Pages of all shipped experiments, each with a picture that stands behind it in a text."""

import json
import multiprocessing
import shutil
import warnings
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path

from experiment_pictures import draw_scene_and_image

import robsim as rs
from robsim.page import load_recording
from robsim.studio.scenario_shelf import ScenarioShelf

CARDS = "experiments.json"
SCENE, IMAGE = (576, 540), (384, 540)  # pixels of the parts of a picture
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
    picture = draw_scene_and_image(experiment, run, SCENE, IMAGE)
    picture.save(folder / f"{name}.webp", "WEBP", quality=QUALITY)
    arrived = page["outcome"] == rs.Outcome.CONVERGED.name
    ending = page["events"][-1]["text"]
    texts = (name, entry["title"], entry["about"], entry["group"], ending)
    return LiveExperiment(*texts, arrived, isinstance(run, rs.tasks.MissionRun))
