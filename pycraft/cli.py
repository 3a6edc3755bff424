"""The command line: pycraft tour | check | accuracy | stability | bench | peers | lab."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Annotated, Any, Optional

import typer
from rich.console import Console
from rich.table import Table

app = typer.Typer(add_completion=False, no_args_is_help=True, help="A workbench for the Spatial Operator Algebra over a multibody model.")
console = Console()
if not console.is_terminal:  # a file or a pipe has no width of its own
    console = Console(width=140)

Model = Annotated[str, typer.Argument(help="A URDF or MJCF file, or the name of a robot that comes with the package (see pycraft.robots).")]
Root = Annotated[str, typer.Option(help="fixed | free: a free hinge first.")]
Mimic = Annotated[str, typer.Option(help="refuse | lock | free: what becomes of mimic joints.")]


def load_model(name: str, root: str = "fixed", mimic: str = "refuse") -> Any:
    """A robot of the package by name, or a file."""
    from . import robots
    from .models.load import load
    from .models.warning import ModelWarning

    if name in robots.names() and not Path(name).exists():
        return getattr(robots, name)()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", ModelWarning)
        model = load(name, root=root, mimic=mimic)  # type: ignore[arg-type]
    for warning in caught:
        console.print(f"[yellow]warning:[/] {warning.message}", highlight=False)
    return model


def _guarded(f: Any) -> Any:
    """Errors of the package end a command with their text, not with a traceback."""
    from . import _core

    try:
        return f()
    except _core.Error as error:
        console.print(f"[bold red]error:[/] {error}", highlight=False)
        raise typer.Exit(2) from None


@app.command()
def tour(
    model: Annotated[Optional[str], typer.Argument(help="A URDF or MJCF file, or a robot's name; the Panda by default.")] = None,  # noqa: UP045 - typer reads it
    root: Root = "fixed",
    mimic: Mimic = "refuse",
) -> None:
    """Load a real robot, type the book's formulas, factor, invert, and check the theorems."""
    from .tour import run

    _guarded(lambda: run(load_model(model or "panda", root, mimic), console))


@app.command()
def check(
    model: Model,
    states: Annotated[int, typer.Option(help="Random states beside the present one.")] = 3,
    seed: Annotated[int, typer.Option(help="Seed of the states.")] = 0,
    precision: Annotated[str, typer.Option(help="The wider scalar: extended | quad | 50 | 100 (digits).")] = "extended",
    json: Annotated[bool, typer.Option("--json", help="The report as JSON.")] = False,
    root: Root = "fixed",
    mimic: Mimic = "refuse",
) -> None:
    """Check every theorem on a model; exit status 1 if one fails that should hold."""

    def run() -> Any:
        robot = load_model(model, root, mimic)
        wide = int(precision) if precision.isdigit() else precision
        if json:
            return robot.soa.check(states=states, seed=seed, precision=wide)
        with console.status("checking") as status:
            return robot.soa.check(states=states, seed=seed, precision=wide, progress=lambda name: status.update(name))

    report = _guarded(run)
    if json:
        print(report.to_json())
    else:
        console.print(report.table())
        console.print(report.summary(), highlight=False)
    raise typer.Exit(0 if report else 1)


@app.command()
def bench(seconds: Annotated[float, typer.Option(help="Seconds per figure.")] = 0.1) -> None:
    """Measure the bounds on speed; exit status 1 if one is missed."""
    from .bench import run

    with console.status("measuring"):
        results = run(seconds)
    missed = 0
    for heading, figures in results.items():
        table = Table(title=heading, title_justify="left", box=None, header_style="bold")
        for column, justify in (("figure", "left"), ("measured", "right"), ("bound", "right"), ("", "left")):
            table.add_column(column, justify=justify)  # type: ignore[arg-type]
        for figure in figures:
            missed += not figure.passed
            style = "" if figure.passed else "bold red"
            bound = "" if figure.bound is None else f"{figure.bound:g} {figure.unit}"
            table.add_row(figure.name, f"{figure.value:.3g} {figure.unit}", bound, figure.note, style=style)
        console.print(table)
    raise typer.Exit(1 if missed else 0)


@app.command()
def accuracy(
    model: Model,
    integration: Annotated[bool, typer.Option("--integration", help="Integrators and tolerances instead of forms and precisions.")] = False,
    seconds: Annotated[float, typer.Option(help="Seconds per figure.")] = 0.05,
    duration: Annotated[float, typer.Option(help="Seconds of the motion that is integrated.")] = 1.0,
    seed: Annotated[int, typer.Option(help="Seed of the states and forces.")] = 0,
    csv: Annotated[Optional[Path], typer.Option(help="Write the rows as CSV.")] = None,  # noqa: UP045 - typer reads it
    json: Annotated[Optional[Path], typer.Option(help="Write the rows as JSON.")] = None,  # noqa: UP045
    plot: Annotated[Optional[Path], typer.Option(help="Draw error against time (PNG, SVG or PDF).")] = None,  # noqa: UP045
    root: Root = "fixed",
    mimic: Mimic = "refuse",
) -> None:
    """What accuracy costs on a model: error, time and memory of every form, refinement, precision and method; or of integrators."""
    from .accuracy.table import accuracy as measure
    from .accuracy.work_precision import work_precision

    def run() -> Any:
        robot = load_model(model, root, mimic)
        with console.status("measuring") as status:

            def progress(label: str) -> None:
                status.update(label)

            if not integration:
                return measure(robot, seed=seed, seconds=seconds, progress=progress)
            robot.gravity = robot.gravity if any(robot.gravity) else (0.0, 0.0, -9.81)
            state = robot.random_state(seed)
            return work_precision(robot, state.q, 0 * state.v, duration=duration, seconds=seconds, progress=progress)

    table = _guarded(run)
    console.print(table.table())
    if csv:
        table.to_csv(csv)
    if json:
        table.to_json(json)
    if plot:
        import matplotlib

        matplotlib.use("Agg")
        axes = table.plot()
        figure = axes[0].figure if integration else axes.figure
        figure.savefig(plot, dpi=150, bbox_inches="tight")
    for path in (csv, json, plot):
        if path:
            console.print(f"wrote {path}", highlight=False)


@app.command()
def stability(
    seeds: Annotated[int, typer.Option(help="Random instances a case.")] = 200,
    steps: Annotated[int, typer.Option(help="Steps of each trajectory.")] = 1_000_000,
    case: Annotated[str, typer.Option(help="Only cases whose name or family has this text.")] = "",
    peers: Annotated[bool, typer.Option(help="Pinocchio, MuJoCo, Drake, as far as they are installed, side by side.")] = True,
    output: Annotated[Optional[Path], typer.Option(help="Where to write the table (Markdown).")] = None,  # noqa: UP045 - typer reads it
    csv: Annotated[Optional[Path], typer.Option(help="Write the rows as CSV.")] = None,  # noqa: UP045
    json: Annotated[Optional[Path], typer.Option(help="Write the rows as JSON.")] = None,  # noqa: UP045
) -> None:
    """Run the hard cases over forms, refinements and precisions; exit status 1 if a bound does not hold."""
    from .accuracy import stability as hard
    from .accuracy.catalogue import catalogue
    from .accuracy.stability_markdown import markdown

    def run() -> Any:
        chosen = [c for c in catalogue() if case.lower() in c.name.lower() or case.lower() in c.family.lower()]
        if not chosen:
            console.print(f"[bold red]error:[/] no hard case has {case!r} in its name or family", highlight=False)
            raise typer.Exit(2)
        with console.status("measuring") as status:
            return hard.run(seeds, steps, cases=chosen, peers=peers, progress=lambda name: status.update(name))

    results = _guarded(run)
    if output:
        output.parent.mkdir(parents=True, exist_ok=True)
        output.write_text(markdown(results), encoding="utf-8")
    else:
        console.print(results.table())
    if csv:
        results.to_csv(csv)
    if json:
        results.to_json(json)
    for path in (output, csv, json):
        if path:
            console.print(f"wrote {path}", highlight=False)
    for row in results.failures:
        console.print(f"[red]{row['case']}, {row['method']}: {row['failed']}[/]", highlight=False)
    raise typer.Exit(0 if results else 1)


@app.command()
def peers(
    output: Annotated[Optional[Path], typer.Option(help="Where to write the table (Markdown).")] = None,  # noqa: UP045 - typer reads it
    states: Annotated[int, typer.Option(help="Random states per robot.")] = 20,
    seed: Annotated[int, typer.Option(help="Seed of the states.")] = 0,
) -> None:
    """Compare every robot of example-robot-data with Pinocchio (extra [peers])."""
    from .interop.peers import compare_all, markdown

    def run() -> Any:
        with console.status("comparing") as status:
            return compare_all(states, seed, lambda name: status.update(name))

    results = _guarded(run)
    text = markdown(results, states)
    if output:
        output.parent.mkdir(parents=True, exist_ok=True)
        output.write_text(text)
        console.print(f"wrote {output}")
    else:
        console.print(text, highlight=False)
    failed = [r for r in results if not r.refused and not r.passed]
    for r in failed:
        worst = max(r.ratio, key=lambda k: r.ratio[k])
        console.print(f"[red]{r.robot} ({r.root}): {worst} is {r.ratio[worst]:.1f} times its bound[/]")
    raise typer.Exit(1 if failed else 0)


@app.command()
def lab() -> None:
    """Open JupyterLab (extra [lab])."""
    import subprocess
    import sys

    raise typer.Exit(subprocess.call([sys.executable, "-m", "jupyter", "lab"]))


if __name__ == "__main__":
    app()
