"""Run files that were cut, changed, forged or made to harm; a file that opens must be usable."""

import json
import os
import re
import warnings
from functools import cache
from pathlib import Path

import h5py
import numpy as np
from attack.harness import Wrong
from matplotlib import pyplot

import robsim as rs

NAME, PATIENCE = "run files", 60.0
MAGIC = b"\n[RobSim seal 1]\n"
TAIL = 8 + 32 + len(MAGIC)  # bytes: the length of the index, the checksum
SECRET = "that of another file"


def case(seed):
    """Change a run file in one way, and use what opens."""
    random = np.random.default_rng(seed)
    ways = (cut, flipped, spliced, resealed, renumbered, renumbered, retold, retold, rewritten,
            rewritten, edited, edited, nested, of_hdf5)  # fmt: skip
    way = ways[random.integers(len(ways))]
    Path("secret.txt").write_text(SECRET)
    changed = way(random, *make_run_file(int(random.integers(2))))
    if isinstance(changed, bytes):
        Path("bad.nc").write_bytes(changed)
    size = os.path.getsize("bad.nc")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        word = choose_option(random, way)
        try:
            run = rs.open_run("bad.nc", **word)
        except rs.RobSimError:
            return False
        if way in (cut, flipped, spliced) and not word:
            same = run.identical(rs.open_run("good.nc"))
            raise Wrong(f"a file opens that was changed, as {'the same' if same else 'another'}")
        if SECRET in str([each.values.tolist() for each in run.variables.values()]):
            raise Wrong("another file was read")
        if run.nbytes > 100 * size:
            raise Wrong(f"{run.nbytes} bytes of {size}")
        return all([try_use(run, each) for each in USES])


def choose_option(random, way):
    """The explicit option, always for files that HDF5 made, and now and then for others."""
    if not hasattr(rs, "ReplayWarning"):  # of before the word
        return {}
    return {"unsealed": True} if way is of_hdf5 or random.random() < 0.05 else {}


@cache
def scene():
    return rs.load_scenario(rs.examples.path("visp_tutorial")).scene


USES = (
    rs.replay,
    rs.explain,
    rs.diagnose,
    rs.logs.to_table,
    lambda run: rs.logs.to_table(run, of="runs"),
    lambda run: rs.plot.image(run, scene=scene()),
    rs.plot.velocity,
    lambda run: rs.plot.run(run, scene()),
    lambda run: rs.plot.scene(scene(), run=run),
)


def try_use(run, use):
    try:
        use(run)
        pyplot.close("all")
    except rs.RobSimError:
        return False
    return True


@cache
def make_run_file(several):
    """The bytes of a sealed run file, and its seal: content, index."""
    experiment = rs.load_scenario(rs.examples.path("visp_tutorial")).with_(duration=0.2)
    if several:
        experiment = experiment.with_(start=[experiment.start, experiment.start])
    rs.save_run(experiment.run(), "good.nc")
    whole = Path("good.nc").read_bytes()
    if not whole.endswith(MAGIC):  # of a RobSim without seals
        return whole, whole, {"variables": [], "coordinates": [], "attributes": {}}
    length = int.from_bytes(whole[-TAIL:][:8], "little")
    return whole, whole[: -TAIL - length], json.loads(whole[-TAIL - length : -TAIL])


def seal(content, index):
    import hashlib

    text = index if isinstance(index, bytes) else json.dumps(index).encode()
    whole = content + text + len(text).to_bytes(8, "little")
    return whole + hashlib.sha256(whole).digest() + MAGIC


def cut(random, whole, content, index):
    return whole[: random.integers(len(whole))]


def flipped(random, whole, content, index):
    changed = bytearray(whole)
    for at in random.integers(len(whole), size=random.integers(1, 4)):
        changed[at] ^= 1 << random.integers(8)
    return bytes(changed) if changed != whole else whole[:-1]


def spliced(random, whole, content, index):
    a, b, c = np.sort(random.integers(len(whole), size=3))
    changed = whole[:a] + whole[b:c] + whole[a:b] + whole[c:]
    return changed if changed != whole else whole[1:]


def resealed(random, whole, content, index):
    """Other content under a right seal, so that the numbers are others."""
    changed = bytearray(content)
    for at in random.integers(len(content), size=random.integers(1, 2000)):
        changed[at] = random.integers(256)
    return seal(bytes(changed), index)


def renumbered(random, whole, content, index):
    """Other numbers in one variable under a right seal."""
    changed, entries = bytearray(content), [e for e in index["variables"] if e["dtype"] != "text"]
    if not entries:
        return resealed(random, whole, content, index)
    entry = entries[random.integers(len(entries))]
    odd = [0, 1, -1, 7, 11, 100, 127]
    if entry["dtype"] == "<f8":
        odd += [np.nan, np.inf, -np.inf, 1e308, 1e-308, 1e17, 0.04, 1e6]
    numbers = np.frombuffer(changed, entry["dtype"], int(np.prod(entry["shape"])), entry["offset"])
    chosen = random.random(numbers.size) < random.choice([0.01, 0.5, 1.0])
    numbers[chosen | (np.arange(numbers.size) == 0)] = odd[random.integers(len(odd))]
    return seal(bytes(changed), index)


def retold(random, whole, content, index):
    """Other attributes, of the run or of one variable, under a right seal."""
    changed = json.loads(json.dumps(index))
    holders = [changed["attributes"], *(entry["attributes"] for entry in changed["variables"])]
    holder = holders[0 if random.random() < 0.7 else random.integers(len(holders))]
    keys = sorted(holder)
    if keys and random.random() < 0.2:
        del holder[keys[random.integers(len(keys))]]
    else:
        key = keys[random.integers(len(keys))] if keys else "record"
        holder[key] = ODD[random.integers(len(ODD))]
    return seal(content, changed)


def rewritten(random, whole, content, index):
    """Another scenario under a right seal."""
    changed = json.loads(json.dumps(index))
    text = changed["attributes"].get("scenario", "")
    for _ in range(random.integers(1, 4)):
        words = re.findall(r"[\w.-]+", text) or ["x"]
        odd = ["-1", "0", "1e9", "nan", "inf", "1e-300", "true", '""', "[]", "{}", "999999999999"]
        new = [*odd, words[random.integers(len(words))]][random.integers(len(odd) + 1)]
        text = text.replace(words[random.integers(len(words))], new, random.integers(1, 3))
    changed["attributes"]["scenario"] = text
    return seal(content, changed)


ODD = (None, -1, 0, 1, 2, 3, 1 << 40, 10**30, 0.5, -1e308, float("nan"), True, "", "q", "\x1b[2J",
       "\ud800", "../x", "x" * 300, [], [[]], [0] * 70, ["q"], {}, {"dtype": "<f8"}, "<f8", "|O",
       {"dtype": "|O", "values": [1]}, {"dtype": "<f8", "values": [1, 2]},
       {"dtype": "|i1", "values": [999]}, 9, "1e400", ["run", "time"], [["lift", 1 << 50]],
       [["", 1 << 61]], "inf s", "schema = 1\n")  # fmt: skip


def edited(random, whole, content, index):
    """An index with some values changed, removed or repeated."""
    changed = json.loads(json.dumps(index))
    for _ in range(random.integers(1, 3)):
        places = list(walked(changed))
        holder, key = places[random.integers(len(places))] if places else (changed, "attributes")
        what = random.integers(4)
        if what == 0 and holder:
            del holder[key]
        elif what == 1 and places:
            other, there = places[random.integers(len(places))]
            holder[key] = json.loads(json.dumps(other[there]))
        else:
            holder[key] = ODD[random.integers(len(ODD))]
    return seal(content, changed)


def walked(value):
    pairs = value.items() if isinstance(value, dict) else enumerate(value)
    for key, each in list(pairs):
        yield value, key
        if isinstance(each, dict | list):
            yield from walked(each)


def nested(random, whole, content, index):
    depth = int(10 ** random.uniform(1, 6))
    texts = (b"[" * depth, b"[" * depth + b"]" * depth, b'{"a":' * depth, b"9" * depth,
             b'{"variables":[],"variables":[]}', b"\xff\xfe", b"[]", b"null", b"NaN")  # fmt: skip
    return seal(content, texts[random.integers(len(texts))])


def of_hdf5(random, whole, content, index):
    """HDF5 that reaches beyond the file, or claims more than it contains."""
    Path("bad.nc").write_bytes(content)
    with h5py.File("bad.nc", "a") as file:
        name = ("q", "s", "outcome", "end_time", "q0")[random.integers(5)]
        shape, kind = file[name].shape, file[name].dtype
        del file[name]
        harms = (external, linked, soft, virtual, bomb, huge, group, texts)
        harms[random.integers(len(harms))](file, name, shape, kind)


def external(file, name, shape, kind):
    where = [("secret.txt", 0, h5py.h5f.UNLIMITED)]
    file.create_dataset(name, (20,), "i1", external=where)


def linked(file, name, shape, kind):
    with h5py.File("other.nc", "w") as other:
        other["x"] = np.frombuffer(SECRET.encode(), "i1")
    file[name] = h5py.ExternalLink("other.nc", "x")


def soft(file, name, shape, kind):
    file[name] = h5py.SoftLink(f"/{name}")


def virtual(file, name, shape, kind):
    with h5py.File("other.nc", "w") as other:
        other["x"] = np.frombuffer(SECRET.encode(), "i1")
    layout = h5py.VirtualLayout((20,), "i1")
    layout[:] = h5py.VirtualSource("other.nc", "x", (20,))
    file.create_virtual_dataset(name, layout)


def bomb(file, name, shape, kind):
    chunk = (1 << 20,)
    file.create_dataset(name, (1 << 24,), kind, chunks=chunk, compression="gzip", fillvalue=0)
    file[name][: 1 << 20] = 0


def huge(file, name, shape, kind):
    file.create_dataset(name, (10**12,), kind)


def group(file, name, shape, kind):
    file.create_group(name)["x"] = file["qd"]


def texts(file, name, shape, kind):
    file.create_dataset(name, (1000,), h5py.string_dtype())
    file[name][:] = "x" * 1000
