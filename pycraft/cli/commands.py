"""The command line: pycraft tour | check | run | view | accuracy | stability | bench | peers | lab."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.markup import escape
from rich.table import Table

from .live import view as view_scene
from .runs import run as run_scene
from .terminal import Commands, console, diagnostics, fail, note

app = typer.Typer(
    cls=Commands,
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    help="A workbench for the Spatial Operator Algebra over a multibody model. Tables fit the terminal, or the environment's COLUMNS; "
    "files and pipes, which have no width of their own, get 140 columns.",
)

Model = Annotated[str, typer.Argument(help="A TOML, URDF, SDF or MJCF file, or the name of a robot (see pycraft.load).")]
Root = Annotated[
    str | None, typer.Option(help="fixed | free: the carrier of the root link; by default fixed for files, and the robot's own for names.")
]
Mimic = Annotated[str, typer.Option(help="couple | refuse | lock | free: how to treat a file's mimic joints.")]


def _version(asked: bool) -> None:
    if asked:
        from importlib.metadata import version

        console.print(f"pycraft {version('pycraft-soa')}", highlight=False)
        raise typer.Exit()


@app.callback()
def options(
    version: Annotated[bool, typer.Option("--version", help="Show the version and exit.", callback=_version, is_eager=True)] = False,
) -> None:
    """A workbench for the Spatial Operator Algebra over a multibody model."""


def load_model(name: str, root: str | None = None, mimic: str = "couple") -> Any:
    """Return the model of a file, or a robot by its name. ModelError, with the nearest names, if it is neither."""
    from ..models.loaders.load import load

    return load(name, root=root, mimic=mimic)


def check_outputs(**paths: Path | None) -> None:
    """Check output paths before the measurement: the folder exists, a picture has a format."""
    taken: dict[Path, str] = {}
    for option, path in paths.items():
        if path is None:
            continue
        other = taken.setdefault(path.absolute(), option)
        if other != option and path.absolute().parent != Path("/dev"):
            fail(f"--{other} and --{option} name the same file, {path}")
        if path.is_dir():
            fail(f"--{option} {path}: a folder; give a file in it")
        if not path.absolute().parent.is_dir():
            fail(f"--{option} {path}: there is no folder {path.parent}; make it first")
        if not os.access(path if path.exists() else path.absolute().parent, os.W_OK):
            fail(f"--{option} {path}: cannot be written")
        if option == "plot":
            from matplotlib.backend_bases import FigureCanvasBase

            known = FigureCanvasBase.get_supported_filetypes()
            if path.suffix.removeprefix(".").lower() not in known:
                fail(f"--plot {path}: a picture has the extension of its format; there are {', '.join(sorted(known))}")


def check_least(least: int, **counts: int) -> None:
    """Check numbers of options that have a least value."""
    for option, count in counts.items():
        if count < least:
            fail(f"--{option} {count}: a whole number, {least} or more")


def check_seconds(**durations: float | None) -> None:
    """Check seconds of options: finite, not negative."""
    for option, given in durations.items():
        if given is not None and not 0 <= given < float("inf"):
            fail(f"--{option} {given}: a finite number of seconds, zero or more")


@app.command()
def tour(
    model: Annotated[str | None, typer.Argument(help="A TOML, URDF or MJCF file, or a robot's name; the Panda by default.")] = None,
    root: Root = None,
    mimic: Mimic = "couple",
) -> None:
    """Load a real robot, type the book's formulas, factor, invert, and check the theorems."""
    from .tour import run

    run(load_model(model or "panda", root, mimic), console)


@app.command()
def check(
    model: Model,
    states: Annotated[int, typer.Option(help="Random states beside the present one.")] = 3,
    seed: Annotated[int, typer.Option(help="Seed of the states.")] = 0,
    precision: Annotated[str, typer.Option(help="The first scalar beside double: extended | quad | 50 | 100 (digits).")] = "extended",
    every: Annotated[bool, typer.Option("--all", help="The long form: residuals, bounds, hypotheses and notes of every theorem.")] = False,
    json: Annotated[bool, typer.Option("--json", help="The report as JSON.")] = False,
    dialect: Annotated[str | None, typer.Option(help="Of a paper: Featherstone | Khatib | Mueller | Park | Saha | Wensing.")] = None,
    root: Root = None,
    mimic: Mimic = "couple",
) -> None:
    """Check every theorem on a model, or the displayed equations of a LaTeX paper (a .tex file, on random trees).

    One line per theorem, the verdict first; theorems that do not simply hold come before the others.

    Exit status 1 if something fails that should hold, 3 if something is undecided, or undefined on the model.
    """
    check_least(0, states=states, seed=seed)
    wide = int(precision) if precision.isdecimal() else precision
    if model.endswith(".tex"):
        for option, given in (("all", every), ("root", root is not None), ("mimic", mimic != "couple")):
            if given:
                fail(f"--{option} belongs to models; a paper is checked on random trees, and shown in full")
        _check_paper(model, states, seed, wide, json, dialect)
    robot = load_model(model, root, mimic)
    with diagnostics.status("checking") as status:
        report = robot.soa.check(states=states, seed=seed, precision=wide, progress=lambda name: status.update(escape(name)))
    if json:
        print(report.to_json())
    else:
        console.print(report.summary(), markup=False, highlight=False)
        console.print(report.table() if every else report.lines(console.width))
    raise typer.Exit(report.status)


def _check_paper(path: str, states: int, seed: int, precision: str | int, json: bool, dialect: str | None) -> None:
    from ..identities.paper import check_paper

    with diagnostics.status("reading") as status:
        report = check_paper(path, states=max(states, 1), seed=seed, precision=precision, progress=status.update, dialect=dialect)
    print(report.to_json() if json else report)
    raise typer.Exit(report.status)


app.command("run")(run_scene)
app.command("view")(view_scene)


@app.command()
def bench(
    seconds: Annotated[float, typer.Option(help="Seconds per figure.")] = 0.1,
    peers: Annotated[bool, typer.Option("--peers", help="Beside Pinocchio and MuJoCo, on robots and chains.")] = False,
    quick: Annotated[bool, typer.Option("--quick", help="With --peers: two robots and two short chains.")] = False,
    json: Annotated[Path | None, typer.Option(help="With --peers: write the figures as JSON.")] = None,
    plot: Annotated[Path | None, typer.Option(help="With --peers: draw cost against links (PNG, SVG or PDF).")] = None,
    page: Annotated[Path | None, typer.Option(help="With --peers: write the page docs/performance.md.")] = None,
) -> None:
    """Measure the bounds on speed; exit status 1 if one is missed. With --peers, speed beside other packages, met goals and missed ones."""
    from .bench import run

    check_seconds(seconds=seconds)
    check_outputs(json=json, plot=plot, page=page)
    if peers:
        from .bench_peers import bench_peers

        return bench_peers(seconds, quick, json, plot, page)
    if quick or json or plot or page:
        fail("--quick, --json, --plot and --page belong to bench --peers")
    with diagnostics.status("measuring"):
        results = run(seconds)
    missed = []
    for heading, figures in results.items():
        table = Table(title=heading, title_justify="left", box=None, header_style="bold")
        for column, justify in (("figure", "left"), ("measured", "right"), ("bound", "right"), ("", "left")):
            table.add_column(column, justify=justify)  # type: ignore[arg-type]  # rich's words
        for figure in figures:
            missed += [] if figure.passed else [figure]
            style = "" if figure.passed else "bold red"
            bound = "" if figure.bound is None else f"{figure.bound:g} {figure.unit}"
            table.add_row(figure.name, f"{figure.value:.3g} {figure.unit}", bound, figure.note, style=style)
        console.print(table)
    for figure in missed:  # red is invisible in a file
        text = f"{figure.name}: {figure.value:.3g} {figure.unit} is over its bound, {figure.bound:g} {figure.unit}"
        console.print(text, style="red", markup=False, highlight=False)
    raise typer.Exit(1 if missed else 0)


def _write(table: Any, csv: Path | None, json: Path | None, plot: Path | None) -> None:
    """Write the table to the requested files."""
    if csv:
        table.to_csv(csv)
    if json:
        table.to_json(json)
    if plot:
        import matplotlib

        matplotlib.use("Agg")
        axes = table.plot()
        figure = axes.figure if hasattr(axes, "figure") else axes[0].figure
        figure.savefig(plot, dpi=150, bbox_inches="tight")
    for path in (csv, json, plot):
        if path:
            note(f"wrote {path}")


@app.command()
def accuracy(
    model: Model,
    integration: Annotated[bool, typer.Option("--integration", help="Integrators and tolerances instead of forms and precisions.")] = False,
    form: Annotated[list[str] | None, typer.Option(help="Only this form; may be repeated.")] = None,
    precision: Annotated[list[str] | None, typer.Option(help="Only this precision; may be repeated.")] = None,
    method: Annotated[list[str] | None, typer.Option(help="Only this method, or integrator; may be repeated.")] = None,
    error: Annotated[float | None, typer.Option(help="Name the cheapest row whose error is at most this.")] = None,
    seconds: Annotated[float, typer.Option(help="Seconds per figure.")] = 0.05,
    duration: Annotated[float | None, typer.Option(help="Seconds of the integrated motion (default: 1).")] = None,
    seed: Annotated[int, typer.Option(help="Seed of the states and forces.")] = 0,
    front: Annotated[bool, typer.Option("--front", help="Print only the Pareto front.")] = False,
    csv: Annotated[Path | None, typer.Option(help="Write the rows as CSV.")] = None,
    json: Annotated[Path | None, typer.Option(help="Write the rows as JSON.")] = None,
    plot: Annotated[Path | None, typer.Option(help="Draw error against time (PNG, SVG or PDF).")] = None,
    root: Root = None,
    mimic: Mimic = "couple",
) -> None:
    """Show the cost of accuracy on a model: error, time and memory of every form, refinement, precision and method; or of integrators.

    Exit status 1 if every row is refused, or none reaches --error.
    """
    from ..accuracy.tables.table import accuracy as measure
    from ..accuracy.tables.work_precision import INTEGRATORS, work_precision

    check_outputs(csv=csv, json=json, plot=plot)
    check_least(0, seed=seed)
    check_seconds(seconds=seconds, duration=duration)
    if error is not None and not error > 0:
        fail(f"--error {error}: a relative error, above zero")
    if integration and (form or precision):
        fail("--form and --precision belong to the table of forms; --integration has --method, an integrator")
    if duration is not None and not integration:
        fail("--duration belongs to --integration")
    if front and integration:
        fail("--front belongs to the table of forms")
    notes = []

    def run() -> Any:
        robot = load_model(model, root, mimic)
        with diagnostics.status("measuring") as status:

            def progress(label: str) -> None:
                status.update(escape(label))

            if not integration:
                wide = [int(p) if p.isdigit() else p for p in precision or ()]
                return measure(
                    robot,
                    forms=form or None,
                    precisions=wide or None,
                    methods=method or None,
                    seed=seed,
                    seconds=seconds,
                    progress=progress,
                )
            if not any(robot.gravity):
                robot.gravity = (0.0, 0.0, -9.81)
                notes.append("the model has no gravity; taken as (0, 0, -9.81) m/s²")
            state = robot.random_state(seed)
            notes.append(f"initial state: random, of seed {seed}, at rest; no generalized forces")
            length = 1.0 if duration is None else duration
            return work_precision(
                robot, state.q, 0 * state.v, duration=length, integrators=method or INTEGRATORS, seconds=seconds, progress=progress
            )

    table = run()
    console.print((table.part(table.front) if front else table).table(console.width))
    if integration:
        notes.append(f"reference: {table.reference}; its own error {table.reference_error:.1e}")
    for text in notes:
        console.print(escape(text), highlight=False)
    for reason, labels in table.refusals.items():
        console.print(f"[bold]refused:[/] {escape('; '.join(labels))}: {escape(reason)}", highlight=False)
    _write(table, csv, json, plot)
    if all(row["refused"] for row in table):
        fail("every row is refused", 1)
    if error is not None:
        try:
            best = table.fastest(error)
        except ValueError as none:
            fail(str(none), 1)
        console.print(
            f"cheapest for {error:g}: {escape(table.label(best))}, error {best['error']:.1e}, {table.cell('seconds', best)}",
            highlight=False,
        )


@app.command()
def stability(
    seeds: Annotated[int, typer.Option(help="Random instances per case.")] = 200,
    steps: Annotated[int, typer.Option(help="Steps of each trajectory.")] = 1_000_000,
    case: Annotated[str, typer.Option(help="Only cases with this text in their name or family.")] = "",
    peers: Annotated[bool, typer.Option(help="Pinocchio, MuJoCo, Drake, if installed, side by side.")] = True,
    output: Annotated[Path | None, typer.Option(help="Where to write the table (Markdown).")] = None,
    csv: Annotated[Path | None, typer.Option(help="Write the rows as CSV.")] = None,
    json: Annotated[Path | None, typer.Option(help="Write the rows as JSON.")] = None,
) -> None:
    """Run the hard cases over forms, refinements and precisions; exit status 1 if a bound does not hold."""
    from ..accuracy.hard_cases import stability as hard
    from ..accuracy.hard_cases.catalogue import catalogue
    from ..accuracy.hard_cases.stability_markdown import markdown

    check_least(1, seeds=seeds, steps=steps)
    check_outputs(output=output, csv=csv, json=json)

    def run() -> Any:
        chosen = [c for c in catalogue() if case.lower() in c.name.lower() or case.lower() in c.family.lower()]
        if not chosen:
            fail(f"no hard case has {case!r} in its name or family")
        with diagnostics.status("measuring") as status:
            return hard.run(seeds, steps, cases=chosen, peers=peers, progress=lambda name: status.update(escape(name)))

    results = run()
    if output:
        output.write_text(markdown(results), encoding="utf-8")
    else:
        console.print(results.table(console.width))
    if csv:
        results.to_csv(csv)
    if json:
        results.to_json(json)
    for path in (output, csv, json):
        if path:
            note(f"wrote {path}")
    for row in results.failures:
        text = f"{row['case']}, {row['method']}: {row['failed']}"
        console.print(f"[red]{escape(text)}[/]", highlight=False)
    raise typer.Exit(0 if results else 1)


@app.command()
def peers(
    output: Annotated[Path | None, typer.Option(help="Where to write the table (Markdown).")] = None,
    states: Annotated[int, typer.Option(help="Random states per robot.")] = 20,
    seed: Annotated[int, typer.Option(help="Seed of the states.")] = 0,
) -> None:
    """Compare every robot of example-robot-data with Pinocchio (extra \\[peers])."""
    from ..peers.peers import compare_all, markdown

    check_least(1, states=states)
    check_least(0, seed=seed)
    check_outputs(output=output)

    def run() -> Any:
        with diagnostics.status("comparing") as status:
            return compare_all(states, seed, lambda name: status.update(escape(name)))

    results = run()
    text = markdown(results, states)
    if output:
        output.write_text(text, encoding="utf-8")
        note(f"wrote {output}")
    else:
        console.print(text, markup=False, highlight=False)
    failed = [r for r in results if not r.refused and not r.passed]
    for r in failed:
        worst = max(r.ratio, key=lambda k: r.ratio[k])
        console.print(f"{r.robot} ({r.root}): {worst} is {r.ratio[worst]:.1f} times its bound", style="red", markup=False, highlight=False)
    raise typer.Exit(1 if failed else 0)


@app.command()
def lab() -> None:
    """Open JupyterLab (extra \\[lab])."""
    import subprocess
    import sys

    from ..interop.packages import required

    required("jupyterlab", "lab", "the lab needs")
    raise typer.Exit(subprocess.call([sys.executable, "-m", "jupyter", "lab"]))
