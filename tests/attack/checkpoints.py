"""Checkpoints that were cut, changed or forged; whatever is taken up ends as a run of its size."""

import json
import signal
import warnings
from functools import cache
from io import BytesIO
from pathlib import Path

import numpy as np
from attack.harness import Wrong

import robsim as rs
from robsim.container import pack_container, unpack_container
from robsim.engine.loop import Loop
from robsim.run import checkpoint

NAME, PATIENCE = "checkpoints", 60.0
ODD = [0, 1, -1, 7, 8, 2.5, 10**9, 10**15, 2**62, 10**30, -(2**31), 0.5, True, None, "x", [], {}]
NUMBERS = [0.0, 1.0, -1.0, 5e-324, 1e-300, 7.5, 1e18, -1e18, 1e308, np.inf, -np.inf, np.nan]


def case(seed):
    """Change the checkpoint of an experiment in one way, and take it up."""
    random = np.random.default_rng(seed)
    experiment = experiments()[random.integers(len(experiments()))]
    content = make_checkpoint(experiment)
    way = (cut, flipped, retold, retold, renumbered, renumbered, reshaped)[random.integers(7)]
    changed = way(random, content)
    Path("bad").write_bytes(changed)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            run = experiment.run(checkpoint="bad", resume=True)
        except rs.RobSimError:
            return False
        if way in (cut, flipped) and changed != content:
            raise Wrong("a checkpoint is taken up that was changed")
        wanted = dict(experiment.run().sizes)
        if {**run.sizes, "time": min(run.sizes["time"], wanted["time"])} != wanted | {
            "time": run.sizes["time"]  # all may have ended before
        }:
            raise Wrong(f"a run of other sizes: {dict(run.sizes)}")
    return True


@cache
def experiments():
    """A batch with noise and late images, a guarded arm, and one with a law that remembers."""
    visp = rs.load_scenario(rs.examples.path("visp_tutorial")).with_(duration=20.0)
    starts = visp.start + np.outer(np.linspace(-0.02, 0.05, 11), np.eye(1, 7))
    late = visp.with_(start=starts, sensing=rs.Sensing(noise=0.5, latency=0.1, dropped=0.2))
    seen = late.with_(task=rs.IBVS(visp.task.goal, interaction=rs.laws.Broyden()), record=7)
    safe = rs.load_scenario(rs.examples.path("eye_in_hand")).with_(safety=rs.Safety(), record=3)
    return late, seen, safe


@cache
def make_checkpoint(experiment):
    """The bytes of a checkpoint of an experiment that was stopped after some bursts."""
    taken, take = [], Loop._take

    def counted(self, going, burst):
        taken.append(going)
        self.stopped = self.stopped or len(taken) == 5
        return take(self, going, 4)

    signal.signal(signal.SIGINT, signal.default_int_handler)
    interval, checkpoint.INTERVAL, Loop._take = checkpoint.INTERVAL, 0.0, counted
    try:
        experiment.run(lambda share: None, checkpoint="good", chunk=4, threads=1)
    except rs.errors.Interrupted:
        return Path("good").read_bytes()
    finally:
        checkpoint.INTERVAL, Loop._take = interval, take
    raise AssertionError("it was not stopped")


def cut(random, content):
    return content[: random.integers(len(content))]


def flipped(random, content):
    changed = bytearray(content)
    changed[random.integers(len(content))] ^= 1 << random.integers(8)
    return bytes(changed)


def retold(random, content):
    """Another value somewhere in the header, under a right checksum."""
    header, arrays = unpack_container(BytesIO(content))
    header = json.loads(json.dumps(header))
    chunks = header["loops"][0]["chunks"]
    at = random.choice([*chunks, *chunks, *chunks, header["loops"][0], header])
    key = sorted(at)[random.integers(len(at))]
    if random.random() < 0.2:
        del at[key]
    else:
        at[key] = ODD[random.integers(len(ODD))]
    return pack_container(header, arrays).getvalue()


def renumbered(random, content):
    """Other numbers in some array, under a right checksum."""
    header, arrays = unpack_container(BytesIO(content))
    array = arrays[random.integers(len(arrays))]
    chosen = random.random(array.shape) < random.choice([0.001, 0.1, 1.0])
    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        array[chosen] = np.array(NUMBERS)[random.integers(len(NUMBERS))].astype(array.dtype)
    return pack_container(header, arrays).getvalue()


def reshaped(random, content):
    """An array of another shape or type, or in another place, under a right checksum."""
    header, arrays = unpack_container(BytesIO(content))
    i, j = random.integers(len(arrays), size=2)
    ways = (
        lambda: arrays.__setitem__(i, arrays[j]),
        lambda: arrays.__setitem__(i, arrays[i][..., :-1]),
        lambda: arrays.__setitem__(i, np.concatenate([arrays[i], arrays[i]])),
        lambda: arrays.__setitem__(i, arrays[i].astype("i4") if arrays[i].dtype == bool else
                                   arrays[i].astype("f4")),
        lambda: arrays.pop(i),
        lambda: arrays.insert(i, arrays[j]),
    )  # fmt: skip
    with np.errstate(all="ignore"):
        ways[random.integers(len(ways))]()
    return pack_container(header, arrays).getvalue()
