"""The pages of kinds/: the tables of a scenario file, and the kinds of each family."""

import inspect
from dataclasses import dataclass

import robsim as rs
from robsim.declare.document import format_markdown_table
from robsim.declare.kind_families import families
from robsim.declare.spec import DeclaredClass
from robsim.robot.link_table import LinkTable
from robsim.robot.robot_table import RobotTable
from robsim.run.experiment_text import ExperimentTable, RunTable, StartTable
from robsim.world.mounted_camera import CameraTable

HEAD = 2  # lines of a table above its rows
PIXELS = ("luminance", "defocus", "histogram", "mutual_information", "photometric_mixture")
COMPRESSED = ("cosine_coefficients", "photometric_moments", "principal_components")
SERVO, SPECIAL = ("ibvs", "pbvs", "hybrid", "partitioned"), ("docking", "placing")


@dataclass(frozen=True)
class Family:
    """A family of kinds on a page: all of them, some by name, or all but some."""

    noun: str
    plural: str
    only: tuple[str, ...] = ()
    without: tuple[str, ...] = ()

    def kinds(self) -> dict[str, DeclaredClass]:
        """Return the kinds by name."""
        found = families()[self.noun].kinds
        return {
            name: kind
            for name, kind in found.items()
            if name not in self.without and (not self.only or name in self.only)
        }


@dataclass(frozen=True)
class Page:
    """A page: its title, tables of a scenario file by heading, and families of kinds."""

    title: str
    tables: dict[str, DeclaredClass]
    families: tuple[Family, ...] = ()


PAGES = {
    "file": Page(
        "The whole file, its start and its run",
        {"A whole file": ExperimentTable, "`[start]`": StartTable, "`[run]`": RunTable},
    ),
    "robots": Page(
        "Robots, joints and couplings",
        {"`[[robots]]`": RobotTable, "`[[robots.links]]`": LinkTable},
        (Family("joint kind", "Joint kinds"), Family("coupling", "Couplings")),
    ),
    "objects": Page(
        "Objects and motions", {"`[[objects]]`": rs.Object, "`[[motions]]`": rs.Motion}
    ),
    "shapes": Page("Shapes", {}, (Family("shape", "Shapes"),)),
    "cameras": Page(
        "Cameras and detectors",
        {"`[[cameras]]`": CameraTable, "`[cameras.optics]`": rs.vision.Optics},
        (Family("mark detector", "Mark detectors"),),
    ),
    "servo_tasks": Page("Servo tasks", {}, (Family("task", "Servo tasks", only=SERVO),)),
    "special_tasks": Page(
        "Docking and placing", {}, (Family("task", "Docking and placing", only=SPECIAL),)
    ),
    "tasks": Page(
        "Trajectories, priorities and missions",
        {},
        (Family("task", "Trajectories, priorities and missions", without=SERVO + SPECIAL),),
    ),
    "features": Page(
        "Features of marks",
        {},
        (Family("feature", "Features of marks", without=PIXELS + COMPRESSED),),
    ),
    "pixel_features": Page(
        "Features of all pixels", {}, (Family("feature", "Features of all pixels", only=PIXELS),)
    ),
    "compressed_features": Page(
        "Few numbers of a picture",
        {},
        (Family("feature", "Few numbers of a picture", only=COMPRESSED),),
    ),
    "interaction": Page(
        "Interaction matrices, depths, feed-forwards and weightings",
        {},
        (
            Family("interaction matrix", "Interaction matrices"),
            Family("depth", "Depths"),
            Family("feed-forward", "Feed-forwards"),
            Family("weighting", "Weightings"),
        ),
    ),
    "laws": Page(
        "Laws and gains",
        {},
        (
            Family("law", "Laws"),
            Family("gain", "Gains"),
            Family("inverse", "Inverses"),
            Family("secondary motion", "Secondary motions"),
            Family("projection", "Projections"),
        ),
    ),
    "constraints": Page("Constraints", {}, (Family("constraint", "Constraints"),)),
    "trajectories": Page(
        "Trajectories and curves",
        {},
        (Family("trajectory", "Trajectories"), Family("curve", "Curves")),
    ),
    "endings": Page(
        "Endings and conditions",
        {},
        (Family("ending", "Endings"), Family("condition", "Conditions")),
    ),
    "sensing": Page(
        "Imperfect images",
        {"`[sensing]`": rs.Sensing, "`[[sensing.occlusions]]`": rs.imperfections.Occlusion},
        (Family("image effect", "Image effects"),),
    ),
    "actuation": Page(
        "Imperfect joints and payloads",
        {"`[actuation]`": rs.Actuation, "`[[actuation.payloads]]`": rs.drives.Payload},
        (Family("joint effect", "Joint effects"),),
    ),
    "drives": Page(
        "Drives", {"`[actuation.drive.model]`": rs.drives.DriveModel}, (Family("drive", "Drives"),)
    ),
    "safety": Page(
        "Safety",
        {
            "`[safety]`": rs.Safety,
            "`[safety.fence]`": rs.control.Fence,
            "`[safety.watchdog]`": rs.control.Watchdog,
        },
    ),
    "ros2": Page("ROS 2", {"`[ros2]`": rs.control.RosConnection}),
    "studies": Page(
        "Samplers and starts of studies",
        {},
        (Family("sampler", "Samplers"), Family("start", "Starts")),
    ),
}


def write_kinds() -> dict[str, str]:
    """Return the pages and their index, by path below docs/."""
    listed = {each.noun for page in PAGES.values() for each in page.families}
    if missing := families().keys() - listed:
        raise LookupError(f"docs/kinds_pages.py: no page for {sorted(missing)}")
    pages = {f"kinds/{name}.md": format_page(page) for name, page in PAGES.items()}
    return {"kinds/index.md": format_index(), **pages}


def format_index() -> str:
    """Return the index: a table of the pages, with their tables and kinds."""
    lines = [
        "# Tables of a scenario file",
        "",
        "The keys of each table of a scenario file, and the kinds of each family, as the classes",
        "declare them. The same names are the dotted names of `--set`, `--vary` and",
        "`Experiment.at`. `docs/build.py` writes these pages; [scenario.md](../scenario.md)",
        "explains and shows the tables.",
        "",
        "| page | tables and kinds |",
        "| --- | --- |",
    ]
    for name, page in PAGES.items():
        kinds = [f"`{kind}`" for each in page.families for kind in each.kinds()]
        lines.append(f"| [{page.title}]({name}.md) | {', '.join([*page.tables, *kinds])} |")
    return "\n".join(lines) + "\n"


def format_page(page: Page) -> str:
    """Return a page: each table, and each family with the keys that all its kinds share first."""
    lines = [f"# {page.title}"]
    for title, declared in page.tables.items():
        lines += ["", f"## {title}", "", format_markdown_table(declared)]
    for each in page.families:
        alone = each.plural == page.title
        lines += ["", *([] if alone else [f"## {each.plural}", ""])]
        lines += format_kinds(each.kinds(), "##" if alone else "###")
    return "\n".join([*lines, "", "[All tables](index.md)"]) + "\n"


def format_kinds(kinds: dict[str, DeclaredClass], level: str) -> list[str]:
    """Return the lines of a family: the shared keys, then each kind with its further keys."""
    tables = {name: format_markdown_table(kind).split("\n") for name, kind in kinds.items()}
    rows = [set(table[HEAD:]) for table in tables.values()]
    shared = set.intersection(*rows) if len(rows) > 1 else set()
    lines = []
    if any(is_key(row) for row in shared):
        first = next(iter(tables.values()))
        lines += ["Keys of each kind:", "", *keep_rows(first, shared), ""]
    for name, kind in kinds.items():
        about = (inspect.getdoc(kind) or "").split("\n", 1)[0]
        own = keep_rows(tables[name], set(tables[name]) - {row for row in shared if is_key(row)})
        lines += [f"{level} `{name}`", "", f"`{kind.__name__}`: {about}", "", *own, ""]
    return lines[:-1]


def keep_rows(table: list[str], kept: set[str]) -> list[str]:
    """Return a table with some of its rows, and the titles of groups that have rows left."""
    found: list[str] = []
    for row in table[HEAD:]:
        if not is_key(row):
            found = [*drop_title(found), row]
        elif row in kept:
            found.append(row)
    found = drop_title(found)
    return [*table[:HEAD], *found] if found else ["No further keys."]


def drop_title(rows: list[str]) -> list[str]:
    """Return the rows without a last title that no key follows."""
    return rows if not rows or is_key(rows[-1]) else rows[:-1]


def is_key(row: str) -> bool:
    """Return whether a row of a table describes a key, and not the title of a group."""
    return not row.startswith("| **")
