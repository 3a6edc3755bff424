"""Functions that the core and lower layers call back, attached here and nowhere else: no lower layer imports a higher one.

`_core._face` holds functions by name.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any

from . import _core
from .dynamics.threads import shared_out, thread_count
from .models.embedded_loops import embedded, source_again
from .models.multibody import Multibody, describe
from .operators import loop_letters, operator_set
from .operators.block_view import block_view
from .operators.explanation import explain
from .operators.shown_expression import expression_latex, formula_latex

LATER = {
    "algorithm": ("recursions", "algorithm"),
    "animate": ("view.sweep_film", "SweepFilm"),
    "certify_dynamics": ("accuracy.certificates.certify", "certify_dynamics"),
    "certify_expression": ("accuracy.certificates.certify", "certify_expression"),
    "check_model": ("identities.checker", "check_model"),
    "compile_call": ("compiled", "compile_call"),
    "compile_expression": ("compiled", "compile_expression"),
    "dof_shares": ("view.shares", "Shares"),
    "linked_blocks": ("view.linked_blocks", "LinkedBlocks"),
    "model_html": ("view.model_picture", "model_html"),
    "plan_html": ("view.plan_picture", "plan_html"),
    "play_smoother": ("view.kalman_page", "KalmanPage"),
    "plot_model": ("view.stick_figure", "plot_model"),
    "rerootings": ("view.rerooting_page", "RerootingPage"),
    "solve_ik": ("kinematics.inverse_kinematics", "solve_ik"),
    "theorem_html": ("identities.findings_page", "theorem_html"),
    "view_model": ("viewer.view", "view_model"),
    "view_scene": ("viewer.view", "view_scene"),
}
"""Name: (module, its function or class). Modules that take long to import are imported on the first call."""


def _later(module: str, name: str) -> Callable[..., Any]:
    return lambda *arguments, **options: getattr(import_module(f".{module}", __package__), name)(*arguments, **options)


def attach() -> None:
    """Put the functions where the core and the lower layers find them."""
    _core._face.update(
        block_view=block_view,
        describe=describe,
        embedded=embedded,
        embedded_source=source_again,
        exact_numbers=operator_set.exact_numbers,
        explain=explain,
        expression_latex=expression_latex,
        formula_latex=formula_latex,
        loop_source=loop_letters.loop_source,
        model_from_description=Multibody.from_description,
        operator_from_nodes=operator_set.operator_from_nodes,
        scalar_at=operator_set.scalar_at,
        scalar_gradient=operator_set.scalar_gradient,
        shared_out=shared_out,
        thread_count=thread_count,
        **{name: _later(*place) for name, place in LATER.items()},
    )
