"""Pages of the examples: text, figures and code of each script, and an index with thumbnails."""

import ast
import re
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from PIL import Image

import robsim as rs

ROOT = Path(__file__).parents[2]
EXAMPLES, DOCS = ROOT / "examples", ROOT / "docs"
WIDTH = 400  # of a thumbnail, in pixels
LANGUAGES = {".py": "python", ".toml": "toml", ".urdf": "xml", ".yaml": "yaml"}

GROUPS = {
    "Begin": ("quickstart", "seven_steps"),
    "The chapter": (
        *("section_2_primitives", "section_4_rhino", "chapter_experiments", "section_6_2"),
    ),
    "Large rolls": (
        *("camera_retreat", "retreat_cures", "predictive_servo", "desired_through_the_target"),
    ),
    "Paths in the image and in space": (
        *("straight_image_lines", "pbvs_straight", "pbvs_loses_target", "schemes_compared"),
    ),
    "Equilibria": ("local_minimum", "convergence_domain", "tilted_square", "equilibria"),
    "Depths and calibration": (
        *("depth_scale", "uneven_depth", "calibration_errors", "wrong_dh"),
        *("ten_thousand_calibrations", "calibrate_hand_eye"),
    ),
    "Noise, delays and gains": (
        *("noise_floor", "latency_and_gain", "slow_camera", "joint_lag"),
        *("adaptive_gain", "smooth_start", "joint_limits"),
    ),
    "Robots": (
        *("pan_tilt_tracking", "unicycle_docking", "car", "inspection_a", "inspection_b"),
        *("compare_drives", "puma_tables"),
    ),
    "Studies and suites": ("studies", "ten_thousand_starts", "bench_my_scheme"),
    "Learned features": ("learned_servo", "pose_network"),
    "Logs and other programs": (
        *("bag_there_and_back", "drive_over_udp", "udp_robot", "tag_cell"),
    ),
}
FOLDERS = {
    "pose_network": (
        "A network that estimates the pose from a picture",
        "The network, its weights, its training and its evaluation. `learned_servo.py` uses it.",
    ),
    "tag_cell": (
        "A robot cell with tags",
        "A scenario file of a cell, with the arm as a URDF file and a calibration of ROS. The\n"
        "camera in the hand detects an AprilTag.",
    ),
    "udp_robot": (
        "A robot in another process, over UDP",
        "The robot that `drive_over_udp.py` drives: its packets, its program and its arm.",
    ),
}
# of the figures that no page of docs/ shows
TEXTS = {
    "primitives.png": "A camera 25 cm above a block, and a cylinder beside it, as wireframes",
    "rhino_home.png": "The Rhino XR-4 at home: its arm stretched forwards, its gripper down",
    "rhino_moved.png": "The Rhino XR-4 after a turn of its base, with a raised upper arm",
    "placing_start.png": "The Rhino with a cube before its place, and two cameras that watch it",
    "placing_start_left.png": "The image of the left camera: gripper, cube and place",
    "crane_raised.png": "The crane with a raised and extended boom",
}


@dataclass(frozen=True)
class Figure:
    """A figure of an example: its file, and a text that describes it."""

    path: Path
    text: str


@dataclass(frozen=True)
class Mention:
    """A section of a page that links to an example."""

    page: Path
    title: str
    anchor: str


@dataclass(frozen=True)
class Example:
    """A script or a folder of examples."""

    name: str
    title: str
    text: str
    files: tuple[Path, ...]
    figures: tuple[Figure, ...]
    mentions: tuple[Mention, ...]


def write_example_pages(folder: Path) -> list[str]:
    """Write a page for each example and an index, and return the names of the files.

    The folder stands for docs/examples: links are relative to it. The index has the first name.
    """
    folder.mkdir(parents=True, exist_ok=True)
    examples = read_examples()
    for example in examples.values():
        (folder / f"{example.name}.md").write_text(format_example(example), encoding="utf-8")
        if example.figures:
            write_thumbnail(example.figures[0].path, folder / f"thumbnails/{example.name}.png")
    (folder / "index.md").write_text(format_index(examples), encoding="utf-8")
    return ["index.md", *(f"{name}.md" for name in examples)]


def read_examples() -> dict[str, Example]:
    """Return all examples by name, in the order of the index."""
    found = {name: read_folder(name) for name in FOLDERS}
    for script in EXAMPLES.glob("*.py"):
        found[script.stem] = read_script(script)
    ordered = [name for names in GROUPS.values() for name in names]
    return {name: found[name] for name in [*ordered, *sorted(found.keys() - set(ordered))]}


def read_script(script: Path) -> Example:
    """Return the example of a script, from its docstring and its code."""
    code = script.read_text(encoding="utf-8")
    title, _, text = (ast.get_docstring(ast.parse(code)) or script.stem).partition("\n")
    figures = tuple(Figure(path, find_text(path, title)) for path in find_figures(code))
    mentions = find_mentions(f"examples/{script.name}")
    return Example(script.stem, title.rstrip("."), text.strip(), (script,), figures, mentions)


def read_folder(name: str) -> Example:
    """Return the example of a folder of files."""
    title, text = FOLDERS[name]
    files = sorted(path for path in (EXAMPLES / name).iterdir() if path.suffix in LANGUAGES)
    return Example(name, title, text, tuple(files), (), find_mentions(f"examples/{name}/"))


def find_figures(code: str) -> list[Path]:
    """Return the stored figures that a script saves, in the order of its code."""
    saved = re.findall(r'\.savefig\(f?"([^"]+\.png)"', code)
    patterns = [re.sub(r"\{.*?\}", "*", name) for name in saved]
    folders = (DOCS / "gallery", DOCS / "figures")
    found = [path for each in patterns for at in folders for path in sorted(at.glob(each))]
    return list(dict.fromkeys(found))


def find_text(figure: Path, title: str) -> str:
    """Return the alternative text of a figure from a page, from `TEXTS`, or from the title."""
    pattern = re.compile(rf"!\[([^\]]+)\]\([^)]*{re.escape(figure.name)}\)")
    found = (pattern.search(text) for text in pages().values())
    return next((each[1] for each in found if each), TEXTS.get(figure.name, title.rstrip(".")))


def find_mentions(path: str) -> tuple[Mention, ...]:
    """Return the sections that name the file of an example, one for each page."""
    found = []
    for page, text in pages().items():
        at = text.find(path)
        if at >= 0:
            heads = re.findall(r"^#+ (.+)$", re.sub(r"```.*?```", "", text[:at], flags=re.S), re.M)
            found.append(Mention(page, heads[-1], format_anchor(heads[-1], first=len(heads) == 1)))
    return tuple(found)


@cache
def pages() -> dict[Path, str]:
    """Return the texts of the README and of docs/, by path."""
    files = [ROOT / "README.md", *sorted(DOCS.rglob("*.md"))]
    generated = (DOCS / "reference", DOCS / "examples")
    kept = [path for path in files if not any(path.is_relative_to(each) for each in generated)]
    return {path: path.read_text(encoding="utf-8") for path in kept}


def format_anchor(heading: str, first: bool) -> str:
    """Return the anchor of a heading as code hosts form it; the first needs none."""
    plain = re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")
    return "" if first else f"#{plain}"


def format_example(example: Example) -> str:
    """Return the page of an example."""
    parts = [f"# {example.title}", example.text]
    parts += [f"![{each.text}]({link_docs(each.path)})" for each in example.figures]
    if example.name in rs.examples.names():
        parts += [f"<!-- live: {example.name} -->", format_command(example.name)]
    parts += [format_file(path) for path in example.files]
    if example.mentions:
        parts += ["## Explanation", *(format_mention(each) for each in example.mentions)]
    return "\n\n".join(part for part in parts if part) + "\n"


def format_command(name: str) -> str:
    """Return the sentence on the shipped experiment of the same name."""
    return (
        f"The experiment ships with RobSim: `robsim run {name}.toml` runs it, and\n"
        f"`robsim examples {name}` copies its file."
    )


def format_file(path: Path) -> str:
    """Return the section of a file: a link to the file, and its content."""
    name = path.relative_to(EXAMPLES).as_posix()
    code = path.read_text(encoding="utf-8").rstrip()
    return (
        f"## {path.name}\n\nSource: [examples/{name}](../../examples/{name}).\n\n"
        f"```{LANGUAGES[path.suffix]}\n{code}\n```"
    )


def format_mention(mention: Mention) -> str:
    """Return the item of a list that leads to the section."""
    title = mention.title.replace("[", "\\[").replace("]", "\\]")
    return f"- [{title}]({link_docs(mention.page)}{mention.anchor})"


def link_docs(path: Path) -> str:
    """Return the link to a file of the repository from docs/examples."""
    if path.is_relative_to(DOCS):
        return f"../{path.relative_to(DOCS).as_posix()}"
    return f"../../{path.relative_to(ROOT).as_posix()}"


def write_thumbnail(figure: Path, path: Path) -> None:
    """Write a small copy of a figure, with few colours for a small file."""
    path.parent.mkdir(exist_ok=True)
    with Image.open(figure) as image:
        size = (WIDTH, round(image.height * WIDTH / image.width))
        white = Image.new("RGBA", image.size, "white")
        white.alpha_composite(image.convert("RGBA"))
    small = white.convert("RGB").resize(size, Image.Resampling.LANCZOS)
    small.quantize(64, Image.Quantize.MAXCOVERAGE, kmeans=2).save(path, optimize=True)


def format_index(examples: dict[str, Example]) -> str:
    """Return the index of all examples in groups, each with its thumbnail."""
    grouped = {name for names in GROUPS.values() for name in names}
    groups = {**GROUPS, "Further examples": tuple(examples.keys() - grouped)}
    parts = [
        "# Examples",
        f"{len(examples)} complete programs. A page shows the figure of a program and its code.",
    ]
    for group, names in groups.items():
        if names:
            cards = "\n\n".join(format_card(examples[name]) for name in names)
            parts += [f"## {group}", f"```{{container}} example-cards\n\n{cards}\n\n```"]
    listed = "\n".join(f"{format_name(name)} <{name}>" for name in examples)
    return "\n\n".join([*parts, f"```{{toctree}}\n:hidden:\n\n{listed}\n```"]) + "\n"


def format_name(name: str) -> str:
    """Return the short title of an example, for the list of pages.

    >>> format_name("camera_retreat")
    'Camera retreat'
    """
    return name.replace("_", " ").capitalize()


def format_card(example: Example) -> str:
    """Return the paragraph of an example in the index."""
    link = f"[{example.title}]({example.name}.md)"
    if not example.figures:
        return link
    picture = f"![{example.figures[0].text}](thumbnails/{example.name}.png)"
    return f"[{picture}]({example.name}.md)\n{link}"
