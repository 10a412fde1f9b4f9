"""Folders of studies with a changed file; what is opened equals the rows that were simulated."""

import shutil
import warnings
from functools import cache
from pathlib import Path

import numpy as np
from attack.harness import Wrong

import robsim as rs

NAME = "study_stores"
ROWS, CHUNKS = "rows-*", "trajectories.zarr/*/c/**/[0-9]"


def case(seed):
    """Change one file of a stored study, open the study and read all its numbers."""
    random = np.random.default_rng(seed)
    shutil.rmtree("changed", ignore_errors=True)
    shutil.copytree(make_store(1), "changed")
    WAYS[random.integers(len(WAYS))](random, Path("changed"))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            result = rs.open_study("changed")
            found = result.table, result.trajectories().load()
        except rs.RobSimError:
            return False
    compare(result, *found)
    return True


def compare(result, table, trajectories):
    """Raise Wrong unless the rows that are there equal the simulated rows."""
    wanted, instants, text = read_wanted()
    if not table.equals(wanted.iloc[table["run"]].reset_index(drop=True)):
        raise Wrong("the table has other numbers")
    if not trajectories.identical(instants.isel(run=table["run"].to_numpy())):
        raise Wrong("the trajectories have other numbers")
    if result.text != text:
        raise Wrong("the study has another text")


@cache
def make_store(seed):
    """Return the folder of a small study with trajectories."""
    one = rs.load_scenario(rs.examples.path("visp_tutorial")).with_(duration=0.4)
    vary = {"task.gain": rs.samplers.Uniform(1.0, 3.0), "task.interaction": ["current", "desired"]}
    how = {"vary": vary, "trajectories": 1, "chunk": 250, "seed": seed}
    return rs.study(one, 250, store=f"study {seed}", **how).folder


@cache
def read_wanted():
    """Return the table, the instants and the text of the unchanged study."""
    result = rs.open_study(make_store(1))
    return result.table, result.trajectories().load(), result.text


def choose(random, folder, pattern):
    """Return one of the files of a pattern."""
    files = sorted(path for path in folder.rglob(pattern) if path.is_file())
    return files[random.integers(len(files))]


def flip_bit(random, path):
    content = bytearray(path.read_bytes())
    content[random.integers(len(content))] ^= 1 << random.integers(8)
    path.write_bytes(content)


def flip_row_bit(random, folder):
    flip_bit(random, choose(random, folder, ROWS))


def flip_chunk_bit(random, folder):
    flip_bit(random, choose(random, folder, CHUNKS))


def flip_text_bit(random, folder):
    flip_bit(random, choose(random, folder, ("study.toml", "study.json")[random.integers(2)]))


def flip_description_bit(random, folder):
    flip_bit(random, choose(random, folder, "zarr.json"))


def cut(random, folder):
    path = choose(random, folder, "*")
    path.write_bytes(path.read_bytes()[: random.integers(path.stat().st_size)])


def remove(random, folder):
    choose(random, folder, "*").unlink()


def remove_chunk(random, folder):
    choose(random, folder, CHUNKS).unlink()


def swap_parts(random, folder):
    """Exchange the contents of two files of the same kind."""
    one, other = (choose(random, folder, (ROWS, CHUNKS)[random.integers(2)]) for _ in range(2))
    content = one.read_bytes()
    one.write_bytes(other.read_bytes())
    other.write_bytes(content)


def take_part(random, folder):
    """Replace a file by a file of a study with another seed, under the old or its own name."""
    pattern = (ROWS, CHUNKS)[random.integers(2)]
    path, other = choose(random, folder, pattern), make_store(2)
    place = other / path.relative_to(folder)
    start = place.name[:32]  # the range of the runs, without a digest
    (place,) = place.parent.glob(f"{start}*") if pattern == ROWS else [place]
    path.unlink()
    shutil.copy(place, path.with_name(place.name) if random.random() < 0.5 else path)


def edit_text(random, folder):
    """Another digit in the text of the study: a bound, a seed, a number of runs or of the scene."""
    path = folder / "study.toml"
    text = path.read_text()
    table = text.index("[study") if random.random() < 0.7 else 0
    digits = [i for i in range(table, len(text)) if text[i].isdigit()]
    at = digits[random.integers(len(digits))]
    path.write_text(f"{text[:at]}{(int(text[at]) + 1) % 10}{text[at + 1 :]}")


WAYS = (
    *(flip_row_bit, flip_row_bit, flip_row_bit, flip_chunk_bit, flip_chunk_bit, flip_text_bit),
    *(flip_description_bit, cut, remove, remove_chunk, swap_parts, take_part, edit_text, edit_text),
)
