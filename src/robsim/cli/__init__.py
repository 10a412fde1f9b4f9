"""The command line: demo, run, compare, check, explain, examples, robots."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from robsim import __version__
from robsim.base.errors import FileError, InputError, Interrupted, RankWarning, RobSimError
from robsim.base.interrupt import undisturbed
from robsim.cli import library
from robsim.cli.files import exists, folder_for, free_folder, write, writing
from robsim.cli.report import report
from robsim.files import examples
from robsim.kernels.jit import is_cold

if TYPE_CHECKING:
    import xarray as xr

    from robsim.analysis.comparison import Comparison
    from robsim.analysis.scheme import Scheme
    from robsim.scenario import Scenario

BAD_INPUT, STOPPED = 2, 130  # exit status; 130 is the shell's number for Ctrl-C
FIGURES = ("image.png", "scene.png", "velocity.png")
FILES = ("run.nc", "scenario.toml", *FIGURES)  # of one run
COMPILING = "compiling the kernels, once on this machine: this takes a few seconds"
COMPARED = ("comparison.nc", "comparison.csv", "comparison.png")


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="robsim")
def cli() -> None:
    """Model, simulate and see robots that are guided by cameras."""


def _output(command: Any) -> Any:
    """The options that demo and run share."""
    command = click.option("--no-figures", is_flag=True, help="Write the run only.")(command)
    command = click.option("--force", is_flag=True, help="Write over an existing run.")(command)
    return click.option(
        "-o", "--output", type=click.Path(path_type=Path), help="Folder for the results."
    )(command)


_set = click.option("--set", "changes", multiple=True, metavar="KEY=VALUE", help="Change a value.")


@cli.command()
@_output
def demo(output: Path | None, force: bool, no_figures: bool) -> None:
    """Run the chapter's section 6.1: a Rhino XR-4 servoing on a cube."""
    folder = folder_for(output or free_folder("robsim-demo"), force, FILES)
    _simulate(_load(examples.path("chapter_6_1"), ()), folder, not no_figures)


@cli.command()
@click.argument("file", type=click.Path(path_type=Path))
@_output
@_set
def run(
    file: Path, output: Path | None, force: bool, no_figures: bool, changes: tuple[str, ...]
) -> None:
    """Simulate the scenario in FILE and write the run, the scenario and the figures."""
    scenario = _load(file, changes)
    folder = folder_for(output or free_folder(f"{file.stem}-run"), force, FILES)
    _simulate(scenario, folder, not no_figures)


@cli.command()
@click.argument(
    "files", nargs=-1, required=True, metavar="FILE...", type=click.Path(path_type=Path)
)
@click.option(
    "--vary", "varied", multiple=True, metavar="KEY=V1,V2,...", help="One scheme for each value."
)
@_output
@_set
def compare(
    files: tuple[Path, ...],
    varied: tuple[str, ...],
    output: Path | None,
    force: bool,
    no_figures: bool,
    changes: tuple[str, ...],
) -> None:
    """Simulate the scenarios in FILE... and measure them beside each other."""
    from robsim.analysis.variants import variants

    if len(varied) > 1:
        raise InputError(f"--vary: one key at a time, got {' and '.join(map(repr, varied))}")
    each = variants(files, *varied)
    scenarios = {name: _load(file, (*changes, *more)) for name, file, more in each}
    if not no_figures:
        for scenario in scenarios.values():
            _check_colors(scenario)
    names = [*COMPARED, *(f"{name}.nc" for name in scenarios)]
    folder = folder_for(output or free_folder("robsim-compare"), force, names)
    _compare(scenarios, folder, not no_figures)


@cli.command()
@click.argument("file", type=click.Path(path_type=Path))
@_set
def check(file: Path, changes: tuple[str, ...]) -> None:
    """Read FILE and try its goal, start and settings without simulating."""
    scenario = _load(file, changes)
    with _warnings_as_lines():
        scenario.check()
    _check_colors(scenario)
    scene = scenario.scene
    click.echo(f"{file}: all is well")
    click.echo(f"  robots   {', '.join(f'{r.name} ({r.nv} velocities)' for r in scene.robots)}")
    click.echo(f"  cameras  {', '.join(c.name for c in scene.cameras)}")
    click.echo(f"  objects  {', '.join(f'{o.name} ({len(o.marks)} marks)' for o in scene.objects)}")


@cli.command()
@click.argument("run", type=click.Path(path_type=Path))
@click.option("--no-experiments", is_flag=True, help="Only read the run; repeat nothing.")
def explain(run: Path, no_experiments: bool) -> None:
    """Say why RUN, a run.nc or the folder that holds it, ended as it did, and what to try."""
    from robsim.analysis.explain import explain as explained
    from robsim.files.netcdf import open_run

    path = run / "run.nc" if exists(run) and run.is_dir() else run
    found = open_run(path)
    try:
        told = explained(found, experiments=not no_experiments)
    except InputError as error:
        raise FileError(f"{path}: {error}") from None
    click.echo(str(told))


cli.add_command(library.examples_)
cli.add_command(library.robots_)


def main() -> None:
    """Run the command line; exit status 0 when a simulation ran, 2 for bad input."""
    try:
        cli(standalone_mode=False)
    except RobSimError as error:
        _fail(f"error: {error}")
    except click.ClickException as error:
        error.show()
        sys.exit(BAD_INPUT)
    except (click.Abort, KeyboardInterrupt):
        click.echo("stopped", err=True)
        sys.exit(STOPPED)
    except BrokenPipeError:  # the reader of our output went away, as `head` does
        sys.stderr.close()


def _fail(message: str) -> None:
    click.echo(message, err=True)
    sys.exit(BAD_INPUT)


def _load(file: Path, changes: tuple[str, ...]) -> Scenario:
    from robsim.scenario import load_scenario

    return load_scenario(file, set=list(changes))


def _simulate(scenario: Scenario, folder: Path, figures: bool) -> None:
    """Run, write, draw and say how it went. What was simulated before Ctrl-C is kept."""
    if figures:
        _check_colors(scenario)
    click.echo(scenario.title or "simulating")
    if _must_compile(scenario):
        click.echo(COMPILING)
    result = _finished(scenario.run, lambda run: _save(run, scenario, folder), folder)
    stopped = _save(result, scenario, folder)
    report(result, folder)
    if stopped:
        sys.exit(STOPPED)
    if figures:
        with _drawing("run is"):
            _draw(result, scenario, folder)


def _compare(scenarios: dict[str, Scenario], folder: Path, figures: bool) -> None:
    """Run all, write, draw and print the table. What was simulated before Ctrl-C is kept."""
    from robsim.analysis.compare import compared
    from robsim.analysis.scheme import Scheme

    schemes = [
        Scheme(name, one.scene, one.task, one.q0, one.settings.keywords)
        for name, one in scenarios.items()
    ]
    if any(_must_compile(scenario) for scenario in scenarios.values()):
        click.echo(COMPILING)

    def save(found: Comparison) -> bool:
        return _save_comparison(found, schemes, folder)

    found = _finished(lambda progress: compared(schemes, progress), save, folder)
    stopped = save(found)
    click.echo(f"{found}\nresults: {folder}")
    if stopped:
        sys.exit(STOPPED)
    if figures:
        with _drawing("runs are"):
            _draw_comparison(found, folder)


def _finished(work: Callable[[Any], Any], save: Callable[[Any], bool], folder: Path) -> Any:
    """What `work` makes with a bar of progress. After Ctrl-C, what there is is saved."""
    try:
        with _warnings_as_lines(), _progress() as progress:
            return work(progress)
    except Interrupted as stop:
        click.echo("stopping: saving what was simulated so far", err=True)
        save(stop.run)
        click.echo(f"stopped; what was simulated so far is in {folder}", err=True)
        sys.exit(STOPPED)
    except (RobSimError, KeyboardInterrupt):
        with suppress(OSError):
            folder.rmdir()  # if it is empty: nothing was simulated
        raise


@contextmanager
def _drawing(what: str) -> Iterator[None]:
    """Ctrl-C ends the command; the files are there."""
    try:
        yield
    except KeyboardInterrupt:
        click.echo(f"stopped while drawing; the {what} complete", err=True)
        sys.exit(STOPPED)


def _save_comparison(found: Comparison, schemes: list[Scheme], folder: Path) -> bool:
    """Write runs, measures and table whole; tells whether Ctrl-C came meanwhile."""
    from robsim.files.netcdf import save_run

    with undisturbed() as stops:
        for scheme in schemes:
            with writing(folder / f"{scheme.name}.nc") as path:
                path.unlink(missing_ok=True)  # of the comparison that was here before
        for name, run in found.runs.items():
            save_run(run, folder / f"{name}.nc")
        save_run(found.data, folder / "comparison.nc")
        write(folder / "comparison.csv", found.csv())
        with writing(folder / "comparison.png") as path:
            path.unlink(missing_ok=True)
    return bool(stops)


def _draw_comparison(found: Comparison, folder: Path) -> None:
    from robsim import plot

    with writing(folder / "comparison.png") as path:
        plot.comparison(found).savefig(path, dpi=200)


def _check_colors(scenario: Scenario) -> None:
    """Only Matplotlib knows which colours there are; ask before the simulation, not after it."""
    from robsim.plot.palette import color

    scene = scenario.scene
    parts = [(f"robots.{r.name}.links.{k.name}", k.shapes) for r in scene.robots for k in r.links]
    parts += [(f"objects.{thing.name}", thing.shapes) for thing in scene.objects]
    parts += [(f"cameras.{c.name}", (c.camera.body,)) for c in scene.cameras if c.camera.body]
    for owner, shapes in parts:
        for shape in shapes:
            try:
                color(shape.color)
            except InputError as error:
                raise FileError(f"{scenario.source}: {owner}: {error}") from None


def _must_compile(scenario: Scenario) -> bool:
    from robsim.run.loop import pays

    steps = scenario.settings.duration / scenario.settings.dt
    return is_cold("solve.least_squares") or (pays(1, steps) and is_cold("loop.stride"))


@contextmanager
def _progress() -> Iterator[Any]:
    """A progress bar on a terminal, silence elsewhere."""
    if not sys.stderr.isatty():
        yield None
        return
    with click.progressbar(length=1000, label="simulating", file=sys.stderr) as bar:

        def show(share: float) -> None:
            bar.update(round(1000 * share) - bar.pos)

        yield show
        show(1.0)


@contextmanager
def _warnings_as_lines() -> Iterator[None]:
    """A warning is a line for the user, not a line of our source."""
    import warnings

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", RankWarning)
        try:
            yield
        finally:
            for warning in caught:
                click.echo(f"warning: {warning.message}", err=True)


def _save(result: xr.Dataset, scenario: Scenario, folder: Path) -> bool:
    """Write run and scenario whole; tells whether Ctrl-C came meanwhile."""
    from robsim.files.netcdf import save_run

    with undisturbed() as stops:
        save_run(result, folder / "run.nc")
        write(folder / "scenario.toml", scenario.text)
        for name in FIGURES:
            with writing(folder / name) as path:
                path.unlink(missing_ok=True)  # of the run that was here before
    return bool(stops)


def _draw(result: xr.Dataset, scenario: Scenario, folder: Path) -> None:
    """The figures, an image for each camera; of a batch, images alone; of a summary, none."""
    from robsim import plot

    if "time" not in result.dims:
        return  # of a summary there is nothing to draw
    cameras = list(dict.fromkeys(result.mark_camera.values.tolist()))
    names = [f"image_{camera}" if i else "image" for i, camera in enumerate(cameras)]
    figures = {name: plot.image(result, each) for name, each in zip(names, cameras, strict=True)}
    if "run" not in result.dims:
        figures |= {
            "scene": plot.scene(scenario.scene, run=result),
            "velocity": plot.velocity(result, scenario.scene, _moving_frame(result, scenario)),
        }
    for name, figure in figures.items():
        with writing(folder / f"{name}.png") as path:
            figure.savefig(path, dpi=200)


def _moving_frame(result: xr.Dataset, scenario: Scenario) -> str | None:
    """Whose velocity is shown: None for the camera; where that stands, what carries the target."""
    if not result.sizes["mark"]:
        return None
    scene, target = scenario.scene, str(result.mark_target.values[0])
    stands = not scene.tree.carries(str(result.mark_camera.values[0])).any()
    return scene.object(target).on if stands else None
