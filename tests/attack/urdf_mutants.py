"""URDF files with parts missing, moved, repeated, misspelt, or of odd sizes and encodings."""

from __future__ import annotations

import copy
import random
import re
import time
import warnings
from functools import cache
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from attack.harness import Wrong
from attack.toml_mutants import letters, lines

from robsim import Robot, robots
from robsim.errors import FileWarning, InputError
from robsim.robot.urdf.urdf_link import TOKEN_INERTIA

NAME = "urdf_mutants"
CORPUS = Path(__file__).parents[1] / "inputs" / "urdf"
LONGEST = 2.0  # seconds of the processor for any refusal
NUMBERS = ["0", "-0.0", "1", "-1", "3.14", "1e9", "-1e9", "1e10", "1e18", "1e308", "-1e308"]
NUMBERS += ["5e-324", "1e-300", "1e400", "nan", "inf", "1,5", "0x10", "1_0", "", " ", "${x}"]
NUMBERS += ["9" * 70, "1\u00a02", "\u06631", "1\u2003", "0 0\u00a01", "1 0 0\u3000", "90 deg"]
NUMBERS += ["1e9 1e9 1e9", "0 0 1e-7", "0 0 0", "1 2"]
LETTERS = ["\u00a0", "\ufeff", "\u2028", "\x00", "\x1b", "\u03a9", "&amp;", "&#0;", "&lol;"]
LETTERS += ["stray", *"<>\"'/= \n\r\t-!?", "<![CDATA[x]]>", "<!-- x -->", "<?x y?>", "<link/>"]
BLANKS = " \t\r\n"
TOO_LONG = 5_000_000  # characters: more than is read, and slow to change further
ENCODINGS = ["utf-16", "utf-16-le", "utf-32", "latin-1", "cp1252", "utf-7", "utf-8-sig", "cp037"]
DECLARED = [*ENCODINGS, "UTF-8", "us-ascii", "iso-8859-1", "rot13", "hex", "idna", "x", "koi8-r"]


def case(seed: int) -> bool:
    """Read one mutant; an accepted one is finite at home, and survives writing and reading."""
    rng, path = random.Random(seed), Path("mutant.urdf")
    path.write_bytes(mutant(rng))
    begin = time.process_time()
    robot, message, told = _read(path)
    took = time.process_time() - begin
    if took > LONGEST:
        raise Wrong(f"{took:.1f} s until {message or 'it was taken'!r:.300}")
    if robot is None:
        if str(path) not in message:
            raise Wrong(f"names no file: {message:.300}")
        return False
    if not told:
        _check_plain(path.read_bytes(), robot)
    _check_finite(robot)
    again = Path("again.urdf")
    robot.to_urdf(again)
    back, message, _ = _read(again)
    _check_same(robot, back, message)
    _check_mjcf(robot)
    return True


def mutant(rng: random.Random) -> bytes:
    """Return a URDF file with one to three changes."""
    corpus, written = sources()
    text = rng.choice(corpus if rng.random() < 0.2 else written)
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        change = rng.choice(IN_TEXT if rng.random() < 0.3 else IN_TREES)
        if change in IN_TEXT:
            text = change(rng, text)
            continue
        if len(text) > TOO_LONG:
            return _encoded(rng, text)
        try:
            root = ElementTree.fromstring(text)
        except (ElementTree.ParseError, ValueError):
            return _encoded(rng, text)
        change(rng, root)
        text = ElementTree.tostring(root, "unicode")
    return _encoded(rng, text)


@cache
def sources() -> tuple[list[str], list[str]]:
    """Return the texts of the corpus, and of the robots of the library that can be written."""
    corpus = [path.read_text("utf-8") for path in sorted(CORPUS.glob("*.urdf"))]
    written = []
    for name in robots.names():
        try:
            getattr(robots, name)().to_urdf("library.urdf")
        except InputError:
            continue
        written.append(Path("library.urdf").read_text("utf-8"))
    return corpus, written


def _read(path: Path) -> tuple[Robot | None, str, bool]:
    """Return the robot of a file, or None and why it is refused; and whether there is a warning."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("error")
        warnings.simplefilter("always", FileWarning)
        try:
            return Robot.from_urdf(path), "", bool(caught)
        except InputError as error:
            return None, str(error), bool(caught)


def _check_plain(data: bytes, robot: Robot) -> None:
    """Raise Wrong unless a file that is read without a warning contains nothing more."""
    found = re.match(rb"[^>]*encoding=.([\w-]+)", data)
    if found and found[1].lower() not in (b"utf-8", b"us-ascii", b"iso-8859-1"):
        raise Wrong(f"an odd encoding passes: {found[1]!r}")
    root = ElementTree.fromstring(data)
    known = [root, *(part for tag in ("link", "joint") for part in root.findall(tag))]
    for text in (text for part in known for text in (part.text, *(each.tail for each in part))):
        if (text or "").strip(BLANKS):
            raise Wrong(f"stray text passes: {text!r:.80}")
    for part in root.iter():
        for key in part.attrib.keys() & {"xyz", "rpy", "value", "lower", "upper", "multiplier"}:
            if not part.attrib[key].isascii():
                raise Wrong(f"odd numbers pass: {part.attrib[key]!r:.80}")
    weights = [link.find("inertial/mass") for link in root.findall("link[inertial]")]
    given = [float(each.get("value")) for each in weights if each is not None]
    lost = sum(given) - sum(_masses(robot))
    if lost > 1e-9 * sum(given) + TOKEN_INERTIA.mass * given.count(TOKEN_INERTIA.mass):
        raise Wrong(f"{lost:g} kg vanish of {given!r:.200}")


def _check_finite(robot: Robot) -> None:
    """Raise Wrong unless home is within the limits, and all links are somewhere."""
    low, high = robot.limits.T
    if not (np.isfinite(robot.home) & (robot.home >= low) & (robot.home <= high)).all():
        raise Wrong(f"home is {robot.home}, within {robot.limits.tolist()}"[:300])
    if not np.isfinite(_poses(robot)).all():
        raise Wrong("a link is nowhere at home")


def _poses(robot: Robot) -> np.ndarray:
    return np.array([robot.fk(robot.home, link.name) for link in robot.links])


def _check_same(robot: Robot, back: Robot | None, message: str) -> None:
    """Raise Wrong unless the written file is read as the same robot."""
    if back is None:
        raise Wrong(f"what it writes is refused: {message:.300}")
    poses, ties = _poses(robot), [k.joint.follows for k in robot.links if k.joint.follows]
    turns = max([1.0, *(abs(tie.ratio) + abs(tie.offset) for tie in ties)])  # large angles
    near = {"rtol": 1e-12, "atol": 1e-11 * max(1.0, np.abs(poses).max()) * turns}
    for what, one, other in (
        ("links", *([(k.name, k.parent, len(k.shapes)) for k in r.links] for r in (robot, back))),
        ("coordinates", robot.coordinate_names, back.coordinate_names),
        ("the tip", robot.tip, back.tip),
        ("drives", *([(k.joint.speed, k.joint.effort) for k in r.links] for r in (robot, back))),
        ("colours", *([[s.color for s in k.shapes] for k in r.links] for r in (robot, back))),
    ):
        if one != other:
            raise Wrong(f"{what} come back otherwise: {one!r:.120} and {other!r:.120}")
    for what, one, other in (
        ("limits", robot.limits, back.limits),
        ("home", robot.home, back.home),
        ("poses", poses, _poses(back)),
        ("masses", _masses(robot), _masses(back)),
    ):
        if not np.allclose(one, other, **near):
            raise Wrong(f"{what} come back otherwise: {one!r:.120} and {other!r:.120}")


def _masses(robot: Robot) -> list[float]:
    return [link.inertial.mass if link.inertial else 0.0 for link in robot.links]


def _check_mjcf(robot: Robot) -> None:
    """Raise Wrong unless a model for MuJoCo is refused, or is XML with finite numbers."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FileWarning)
            robot.to_mjcf("again.xml")
    except InputError:
        return
    for element in ElementTree.parse("again.xml").iter():
        for key in element.attrib.keys() & {"pos", "quat", "axis", "range", "size", "polycoef"}:
            if not np.isfinite([float(word) for word in element.attrib[key].split()]).all():
                raise Wrong(f"the model for MuJoCo has {key} {element.attrib[key]:.200}")


def _encoded(rng: random.Random, text: str) -> bytes:
    """Return the bytes of a text, now and then in another encoding, or of another by name."""
    if rng.random() < 0.08:
        text = re.sub(r"<\?xml[^>]*>\s*", "", text)
        text = f'<?xml version="1.0" encoding="{rng.choice(DECLARED)}"?>\n{text}'
    encoding = rng.choice(ENCODINGS) if rng.random() < 0.05 else "utf-8"
    return text.encode(encoding, "replace")


def _some(rng: random.Random, root, tag: str | None = None):
    """Return an element with a tag, or any."""
    return rng.choice([each for each in root.iter(tag)] or [root])


def _attribute(rng: random.Random, root) -> None:
    """Put an odd number, or the value of another attribute, in the place of one."""
    owner = rng.choice([each for each in root.iter() if each.attrib] or [root])
    other = rng.choice([each for each in root.iter() if each.attrib] or [root])
    if owner.attrib:
        key, values = rng.choice(list(owner.attrib)), list(other.attrib.values())
        new = rng.choice(NUMBERS) if rng.random() < 0.7 else rng.choice(values)
        words = owner.attrib[key].split(" ")
        words[rng.randrange(len(words))] = new
        owner.attrib[key] = " ".join(words) if rng.random() < 0.6 else new


def _misspelt(rng: random.Random, root) -> None:
    """Misspell a tag, or a key."""
    one = _some(rng, root)
    if one.attrib and rng.random() < 0.6:
        key = rng.choice(list(one.attrib))
        one.attrib[rng.choice([key[::-1], f"{key}s", key[:-1] or "x"])] = one.attrib.pop(key)
    else:
        one.tag = rng.choice([f"{one.tag}s", one.tag[1:] or "x", "link", "joint", "mimic"])


def _gone(rng: random.Random, root) -> None:
    """Take an element, or an attribute, away."""
    one = rng.choice([each for each in root.iter() if len(each)] or [root])
    if len(one) and rng.random() < 0.7:
        one.remove(rng.choice(list(one)))
    elif one.attrib:
        del one.attrib[rng.choice(list(one.attrib))]


def _moved(rng: random.Random, root) -> None:
    """Put a copy of an element of this or another file somewhere else, or stray text."""
    source = root if rng.random() < 0.6 else ElementTree.fromstring(rng.choice(sources()[1]))
    one, there = copy.deepcopy(_some(rng, source)), _some(rng, root)
    if rng.random() < 0.2:
        there.tail = rng.choice(("stray", "\u00a0", "0 0 1", "]]"))
    else:
        there.insert(rng.randrange(len(there) + 1), one)


def _mimics(rng: random.Random, root) -> None:
    """Let each joint of some mimic the one before it."""
    moving = [j for j in root.iter("joint") if j.get("type") in ("revolute", "prismatic")]
    kept = [j for j in moving if rng.random() < 0.8]
    numbers = rng.sample(["0", "1", "-2", "0.5", "1e-9", "1e9", "-1e9", "1e-300", "5e-324", "7"], 3)
    for before, joint in pairwise(kept):
        for old in joint.findall("mimic"):
            joint.remove(old)
        options = {"multiplier": rng.choice(numbers), "offset": rng.choice(numbers)}
        ElementTree.SubElement(joint, "mimic", {"joint": before.get("name", "x"), **options})
        for limit in joint.findall("limit") * rng.choice((0, 1, 1)):
            limit.attrib["upper"] = rng.choice(["1", "1e9", "1e18", "1e308"])
            limit.attrib["lower"] = rng.choice(["0", "-1", "-1e9", "-1e18", "-1e308", "1e-300"])


def _masses_of_bare(rng: random.Random, root) -> None:
    """Give links a mass, and some of them names as our writer gives them."""
    mass = rng.choice(("5", "0.001", "0", "1e9", "1e-300"))
    for link in root.findall("link"):
        if rng.random() < 0.5 and link.find("inertial") is None:
            inertial = ElementTree.SubElement(link, "inertial")
            ElementTree.SubElement(inertial, "mass", {"value": mass})
            moments = dict.fromkeys(("ixx", "iyy", "izz"), rng.choice(("1e-6", "1", "0", "1e9")))
            ElementTree.SubElement(inertial, "inertia", moments)


def _many(rng: random.Random, root) -> None:
    """Repeat an element very often, or put it within itself."""
    one = _some(rng, root)
    if rng.random() < 0.5:
        one.extend([copy.copy(each) for each in list(one)[:1]] * rng.choice((3, 3000, 60_000)))
    else:
        for _ in range(rng.choice((3, 70))):
            one = ElementTree.SubElement(one, one.tag, one.attrib)


IN_TEXT = [lines, lambda rng, text: letters(rng, text, LETTERS)]
IN_TREES = [_attribute, _attribute, _misspelt, _gone, _moved, _mimics, _masses_of_bare, _many]
