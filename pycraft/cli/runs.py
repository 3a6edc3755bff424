"""`pycraft run`: simulate a scene, from its file or from a model and effects of the command line."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from ..tidy import seconds_text
from .terminal import console, diagnostics, fail, note

SHOWN = 500
"""Number of states kept without --every."""
_SHOWN_BY = {".html": "to_html", ".glb": "to_gltf", ".gltf": "to_gltf", ".usda": "to_usd", ".usdc": "to_usd", ".usd": "to_usd"}
"""Writers of viewable runs, by a file's ending."""
_WRITTEN = "Write the run: .nc (NetCDF), .parquet or .csv; to view it: .html, .glb or .gltf (glTF), .usda, .usdc or .usd."


FromModel = Annotated[
    bool, typer.Option("--from-model", help="Add the effects that the model's file describes: damping, friction, springs, actuators.")
]


def add_offered(scene: Any, wanted: bool) -> None:
    """Add the effects that the model's file describes if requested, and report elements that no effect represents."""
    if not wanted:
        return
    from ..scenes.effects import from_model

    offered = from_model(scene.model)
    scene.add(*offered)
    for text in offered.notes:
        note(f"not offered: {text}")
    if not offered:
        note(f"the file of {scene.model.name!r} describes no effects")


def run(
    what: Annotated[str, typer.Argument(help="A scene's TOML file; a model's file, a robot or a mechanism by name (pycraft.mechanisms).")],
    output: Annotated[Path | None, typer.Option("--output", "-o", help=_WRITTEN)] = None,
    effect: Annotated[
        list[str] | None,
        typer.Option(help="Add an effect: gravity, damping:0.1, spring:2,rest=0.1,hinges=arm_*; may be repeated."),
    ] = None,
    from_model: FromModel = False,
    duration: Annotated[
        float | None, typer.Option("-T", "--duration", help="Seconds to simulate (default: the value in the scene's file).")
    ] = None,
    integrator: Annotated[str | None, typer.Option(help="Integrator (default: the scene file's, else auto).")] = None,
    rtol: Annotated[float | None, typer.Option(help="Relative tolerance of a step.")] = None,
    atol: Annotated[float | None, typer.Option(help="Absolute tolerance of a step.")] = None,
    step: Annotated[float | None, typer.Option(help="Seconds, for integrators with constant steps.")] = None,
    every: Annotated[
        float | None, typer.Option(help=f"Seconds between the states that are kept (default: a {SHOWN}th of the run).")
    ] = None,
    seed: Annotated[int | None, typer.Option(help="Begin at the random state of this seed.")] = None,
    plot: Annotated[bool, typer.Option("--plot", help="Draw coordinates, energies and forces: a PNG beside the output, or here.")] = False,
    save: Annotated[Path | None, typer.Option(help="Write the scene, with its effects and these options, as TOML.")] = None,
    root: Annotated[str | None, typer.Option(help="For a model: fixed | free.")] = None,
    mimic: Annotated[str, typer.Option(help="For a model's file: couple | refuse | lock | free.")] = "couple",
) -> None:
    """Simulate a scene: its file, or a model with only the named effects.

    pycraft run scene.toml -o run.nc; pycraft run panda --effect gravity --effect damping:0.1 -T 5 --plot
    """
    from ..scenes.effect_text import add_from_text
    from .commands import check_least, check_outputs

    picture = (output or Path(Path(what).stem)).with_suffix(".png") if plot else None
    check_outputs(output=output, plot=picture, save=save)
    if output is not None:
        _check_output(output)
    scene = loaded_scene(what, root, mimic)
    add_offered(scene, from_model)
    for text in effect or []:
        add_from_text(scene, text, f"--effect {text}")
    if seed is not None:
        check_least(0, seed=seed)
        state = scene.model.random_state(seed)
        scene.model.q, scene.model.v = state.q, state.v
    given = {"T": duration, "integrator": integrator, "rtol": rtol, "atol": atol, "step": step, "every": every}
    options = scene.run_options | {key: value for key, value in given.items() if value is not None}
    if "T" not in options:
        fail("how long? give -T SECONDS, or a scene's file T in its table [run]")
    if save is not None:
        scene.run_options = options
        scene.save(save)
        note(f"wrote {save}")
    found = _simulated(scene, dict(options), output)
    console.print(_told(scene, found), markup=False, highlight=False)
    if output is not None:
        _write(found, output)
        note(f"wrote {output}")
    if picture is not None:
        _draw(found, picture)


def _check_output(path: Path) -> None:
    from ..scenes.run_gltf import checked_gltf
    from ..scenes.run_page import checked_page
    from ..scenes.run_usd import checked_usd
    from ..scenes.runs_on_disk import checked_output

    checks = {"to_html": checked_page, "to_gltf": checked_gltf, "to_usd": checked_usd}
    try:
        checks.get(_SHOWN_BY.get(path.suffix, ""), checked_output)(path)
    except (OSError, ImportError) as error:
        fail(str(error))


def _write(run: Any, path: Path) -> None:
    """Write the run to a file, by its ending."""
    getattr(run, _SHOWN_BY.get(path.suffix, "save"))(path)


def loaded_scene(what: str, root: str | None, mimic: str) -> Any:
    """Return the scene of a file or a mechanism, or an empty one of a model."""
    from ..models import robots
    from ..scenes import Scene, load_scene, mechanisms
    from .commands import load_model

    known = [name for name, made in vars(mechanisms).items() if getattr(made, "__module__", "") == mechanisms.__name__ and name.islower()]
    is_file = Path(what).is_file()
    if (is_file and _is_scene(what)) or (what in known and what not in robots.names() and not is_file):
        for option, is_given in (("root", root is not None), ("mimic", mimic != "couple")):
            if is_given:
                fail(f"--{option} belongs to models; a scene has its model with it")
        return load_scene(what) if is_file else getattr(mechanisms, what)()
    return Scene(load_model(what, root, mimic))


def _is_scene(path: str) -> bool:
    from ..models.loaders.load import is_toml
    from ..models.loaders.toml_file import TomlFile

    return is_toml(path) and not {"bodies", "nodes"} & set(TomlFile(path).data)


def _simulated(scene: Any, options: dict[str, Any], output: Path | None) -> Any:
    """Return the run. If a run is written to a file, states computed before an error or Ctrl-C are written as well."""
    T = options.pop("T")
    times = _times(T, options.pop("every", None))
    try:
        return scene.simulate(T, t_eval=times, **options)
    except (Exception, KeyboardInterrupt) as error:
        before = getattr(error, "run", None)
        if output is not None and before is not None and len(before):
            _write(before, output)
            note(f"wrote {output} up to {before.t[-1]:g} s")
        raise


def _times(T: float, every: float | None) -> np.ndarray | None:
    """Return the times from 0 to T, including T; None if the scene must refuse T."""
    if every is not None and not 0 < every < float("inf"):
        fail(f"--every {every:g}: a positive number of seconds")
    if not 0 < T < float("inf"):
        return None
    if every is None:
        return np.linspace(0.0, T, SHOWN + 1)
    if T / every > 1e8:
        fail(f"--every {every:g}: {T / every:.1g} states are more than memory holds")
    times = np.arange(int(T / every * (1 + 1e-12)) + 1) * every
    times[-1] = min(times[-1], T)
    return times if times[-1] > T - 1e-9 * every else np.append(times, T)


def _told(scene: Any, found: Any) -> str:
    """Return a summary of the run in a few lines."""
    about, energy = found.statistics, found.energy
    drift = float(np.ptp(found.balance))
    lines = [
        str(scene),
        f"  {found.t[-1]:g} s in {seconds_text(about['seconds'])}: {about['steps']} steps, {about['evaluations']} evaluations, "
        f"{len(found)} states kept",
        f"  kinetic energy {energy['kinetic'][0]:.4g} J at first, {energy['kinetic'][-1]:.4g} J at last",
        f"  kinetic + potential - work within {drift:.1e} J",
    ]
    return "\n".join(lines)


def _draw(found: Any, path: Path) -> None:
    import matplotlib

    matplotlib.use("Agg")
    with diagnostics.status("drawing"):
        found.plot().savefig(path, dpi=110)
    note(f"wrote {path}")
