"""`pycraft view`: a scene or a model in the live viewer."""

from __future__ import annotations

from contextlib import suppress
from typing import Annotated, Any

import typer

from .runs import FromModel, add_offered, loaded_scene
from .terminal import note


def view(
    what: Annotated[str, typer.Argument(help="A scene's TOML file; a model's file, a robot or a mechanism by name (pycraft.mechanisms).")],
    effect: Annotated[
        list[str] | None,
        typer.Option(help="Add an effect: gravity, damping:0.1, spring:2,rest=0.1,hinges=arm_*; may be repeated."),
    ] = None,
    from_model: FromModel = False,
    beside: Annotated[str | None, typer.Option(help="A second scene, given like the first: a ghost that plays beside it.")] = None,
    seed: Annotated[int | None, typer.Option(help="Begin at the random state of this seed.")] = None,
    host: Annotated[str, typer.Option(help="Address to listen on (default: this machine only).")] = "127.0.0.1",
    port: Annotated[int, typer.Option(help="Port; 0 picks a free one.")] = 0,
    browser: Annotated[bool, typer.Option(help="Open the page in the browser.")] = True,
    root: Annotated[str | None, typer.Option(help="For a model: fixed | free.")] = None,
    mimic: Annotated[str, typer.Option(help="For a model's file: couple | refuse | lock | free.")] = "couple",
) -> None:
    """Open a scene or a model in a live browser viewer: sliders, time, effects on and off, plots, values of picked bodies.

    pycraft view panda --effect gravity --effect damping:0.5; pycraft view scene.toml. Ctrl-C ends it.
    """
    from ..scenes.effect_text import add_from_text
    from .commands import check_least

    scene = loaded_scene(what, root, mimic)
    add_offered(scene, from_model)
    for text in effect or []:
        add_from_text(scene, text, f"--effect {text}")
    other = None if beside is None else loaded_scene(beside, None, "couple")
    state: Any = None
    if seed is not None:
        check_least(0, seed=seed)
        state = scene.model.random_state(seed)
    with suppress(KeyboardInterrupt), scene.view(state, beside=other, host=host, port=port) as shown:  # interrupted: how it ends
        note(f"{scene.model.name} at {shown.said}; Ctrl-C ends it")
        if browser:
            import webbrowser

            webbrowser.open(shown.address)
        shown.wait()
