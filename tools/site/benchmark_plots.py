"""Plots of the tables of benchmarks/README.md: numbers of RobSim and of other programs."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from textwrap import fill

import matplotlib as mpl
from markdown_tables import Table, read_number
from matplotlib.axes import Axes
from matplotlib.figure import Figure

THEMES = {
    "light": {"ink": "#1f2328", "grid": "#d4d4d4", "ours": "#0072b2", "batch": "#56b4e9"},
    "dark": {"ink": "#e6e6e6", "grid": "#4a4a4a", "ours": "#56b4e9", "batch": "#9ad4f5"},
}
PEER = {"light": "#b35900", "dark": "#e69f00"}
PEERS = ("cv2", "riley", "MuJoCo", "TinyRenderer", "embreex", "ViSP")  # begin the labels of others
WIDTH = 45  # of a label, in characters
LONG = 16  # bars that an alternative text lists


@dataclass(frozen=True)
class Bar:
    """A number of a table: its label, its text in the table, and the kind of program."""

    label: str
    text: str
    kind: str  # "ours", "batch" or "peer"

    @property
    def value(self) -> float:
        """The number of the text."""
        return read_number(self.text)


@dataclass(frozen=True)
class Group:
    """Bars of one quantity."""

    title: str
    bars: tuple[Bar, ...]


@dataclass(frozen=True)
class Plot:
    """A plot of some tables of a section."""

    name: str
    section: str
    title: str
    unit: str
    read: Callable[[list[Table]], list[Group]]

    def describe(self, tables: list[Table]) -> str:
        """Return an alternative text, with all numbers of a short plot."""
        groups = self.read(tables)
        bars = [bar for group in groups for bar in group.bars]
        if len(bars) > LONG:
            least, most = (f(bars, key=lambda bar: bar.value).text for f in (min, max))
            return f"{self.title}, {self.unit}, from {least} to {most}; the table has all numbers"
        texts = (
            f"{group.title}: " + ", ".join(f"{bar.label} {bar.text}" for bar in group.bars)
            for group in groups
        )
        return f"{self.title}, {self.unit}. " + "; ".join(texts)


def read_peers(table: Table) -> list[Group]:
    """Return the groups of a table with columns what, ours, peer and theirs.

    A row without a quantity of its own belongs to the quantity before.
    """
    groups: dict[str, list[Bar]] = {}
    title = ""
    for what, ours, peer, theirs, _ in table.rows:
        if what not in ("", "the same"):
            title = strip_code(what).partition(";")[0]
            groups[title] = [Bar("RobSim", ours, "ours")]
        groups[title].append(Bar(strip_code(peer).partition(", which")[0], theirs, "peer"))
    return [Group(title, tuple(bars)) for title, bars in groups.items()]


def read_columns(table: Table, columns: dict[str, tuple[str, str]]) -> list[Group]:
    """Return a group for each row, with a bar for each of some columns: {title: (label, kind)}."""
    cells = {title: table.column(title) for title in columns}
    return [
        Group(
            strip_code(row[0]),
            tuple(
                Bar(label, cells[title][i], kind)
                for title, (label, kind) in columns.items()
                if cells[title][i]
            ),
        )
        for i, row in enumerate(table.rows)
    ]


def read_rows(table: Table, title: str, column: str) -> Group:
    """Return one group with a bar for each row; peers are known by the begin of their label."""
    labels = [strip_code(", ".join(row[: table.head.index(column)])) for row in table.rows]
    kinds = ["peer" if label.startswith(PEERS) else "ours" for label in labels]
    cells = table.column(column)
    bars = (Bar(*each) for each in zip(labels, cells, kinds, strict=True))
    return Group(title, tuple(bars))


def read_pictures(tables: list[Table]) -> list[Group]:
    """Return the groups of the two tables of pictures, with the samples in the labels."""
    groups = []
    for table in tables[:2]:
        title, _, _, _ = table.head
        rows = tuple((_label(what, samples), ms, ratio) for what, samples, ms, ratio in table.rows)
        groups.append(read_rows(Table((title, "ms", "ratio"), rows), title, "ms"))
    return groups


def _label(what: str, samples: str) -> str:
    count, _, _ = samples.partition(" ")
    return f"{what}, {count} samples" if samples not in ("", "1") else what


def read_schemes(tables: list[Table]) -> list[Group]:
    """Return the groups of the schemes: the times now, alone and in two batches.

    The head of the table repeats "now"; its place decides.
    """
    places = {2: ("a single run", "ours"), 8: ("4,096 runs", "batch")}
    return [
        Group(row[0], tuple(Bar(label, row[at], kind) for at, (label, kind) in places.items()))
        for row in tables[0].rows
    ]


def strip_code(text: str) -> str:
    """Return a cell without the marks of code."""
    return text.replace("`", "")


PLOTS = (
    Plot(
        "step_of_the_loop",
        "Steps of the loop",
        "A step of a servo loop",
        "microseconds",
        lambda tables: read_peers(tables[0]),
    ),
    Plot("schemes", "Schemes and sizes", "A step of each scheme", "microseconds", read_schemes),
    Plot("pictures", "Pictures and detectors", "A picture", "milliseconds", read_pictures),
    Plot(
        "photometric",
        "Photometric loops",
        "A step of a photometric loop",
        "milliseconds",
        lambda tables: [read_rows(tables[0], "a step", "ms a step")],
    ),
    Plot(
        "poses",
        "Poses from an image",
        "A pose without a guess",
        "microseconds",
        lambda tables: read_columns(
            tables[0],
            {
                "ours, us": ("RobSim", "ours"),
                "OpenCV (IPPE, SQPNP)": ("OpenCV", "peer"),
                "with `solvePnPRefineLM`": ("OpenCV, refined", "peer"),
            },
        ),
    ),
    Plot(
        "kinematics",
        "Kinematics",
        "A call for a Puma 560",
        "microseconds",
        lambda tables: read_peers(tables[0]),
    ),
    Plot(
        "inverse_kinematics",
        "Inverse kinematics of many poses",
        "A solution of 10,000, to 1e-8",
        "microseconds",
        lambda tables: read_columns(
            tables[0],
            {
                "us per solve": ("RobSim", "ours"),
                "theirs, 1e-8": ("roboticstoolbox-python", "peer"),
            },
        ),
    ),
    Plot(
        "dynamics",
        "Dynamics",
        "A configuration of a Panda",
        "microseconds",
        lambda tables: read_columns(
            tables[0],
            {
                "alone": ("RobSim, alone", "ours"),
                "in a batch of 1,000": ("RobSim, in a batch", "batch"),
                "Pinocchio's call from Python": ("Pinocchio", "peer"),
                "MuJoCo's call": ("MuJoCo", "peer"),
            },
        ),
    ),
)


def draw_plot(plot: Plot, tables: list[Table], folder: Path) -> None:
    """Write a plot as SVG for the light and the dark theme: NAME_light.svg, NAME_dark.svg."""
    groups = plot.read(tables)
    title = f"{plot.title}, {plot.unit}{_explain_colors(groups)}"
    for theme, colors in THEMES.items():
        shades = {**colors, "peer": PEER[theme]}
        settings = {"svg.hashsalt": "robsim", "font.size": 9, "text.color": colors["ink"]}
        with mpl.rc_context(settings):
            figure = draw_groups(groups, title, shades)
            figure.savefig(
                folder / f"{plot.name}_{theme}.svg", transparent=True, metadata={"Date": None}
            )


def _explain_colors(groups: list[Group]) -> str:
    peers = any(bar.kind == "peer" for group in groups for bar in group.bars)
    return " (orange: other programs)" if peers else ""


def draw_groups(groups: list[Group], title: str, shades: dict[str, str]) -> Figure:
    """Return a figure of horizontal bars on a logarithmic axis, a block for each group."""
    single = len(groups) > LONG  # many groups: one line each, with the bars in it
    count = len(groups) if single else sum(len(group.bars) + 1 for group in groups)
    figure = Figure(figsize=(7, 0.24 * count + 0.8), layout="constrained")
    axes = figure.add_subplot()
    draw = draw_dots if single else draw_bars
    draw(axes, groups, shades)
    values = [bar.value for group in groups for bar in group.bars]
    axes.set(xscale="log", xlim=(min(values) / 2, max(values) * 3))
    figure.suptitle(title, x=0.01, ha="left", fontsize="medium", color=shades["ink"])
    axes.invert_yaxis()
    axes.grid(axis="x", color=shades["grid"], linewidth=0.6)
    axes.set_axisbelow(True)
    axes.tick_params(colors=shades["ink"], which="both", left=False)
    axes.xaxis.set_major_formatter("{x:g}")
    axes.spines[:].set_visible(False)
    return figure


def draw_bars(axes: Axes, groups: list[Group], shades: dict[str, str]) -> None:
    """Draw each group below its title, and the text of the table at the end of each bar."""
    ticks, labels, at = [], [], 0
    for group in groups:
        place = axes.get_yaxis_transform()
        axes.text(0, at, group.title, transform=place, va="center", weight="bold")
        for bar in group.bars:
            at += 1
            axes.barh(at, bar.value, color=shades[bar.kind], height=0.7)
            axes.annotate(
                bar.text, (bar.value, at), (3, 0), textcoords="offset points", va="center"
            )
            ticks.append(at)
            labels.append(fill(bar.label, WIDTH))
        at += 1
    axes.set_yticks(ticks, labels)
    axes.set_ylim(-0.7, at - 0.4)


def draw_dots(axes: Axes, groups: list[Group], shades: dict[str, str]) -> None:
    """Draw each group in one line, with a dot for each bar and a legend."""
    for place, bar in enumerate(groups[0].bars):
        values = [group.bars[place].value for group in groups]
        axes.plot(values, range(len(groups)), "os"[place], color=shades[bar.kind], label=bar.label)
    axes.set_yticks(range(len(groups)), [group.title for group in groups])
    axes.set_ylim(-0.7, len(groups) - 0.3)
    axes.legend(frameon=False, labelcolor=shades["ink"], loc="lower right")
