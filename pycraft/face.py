"""What the core and the lower rooms call back for, attached here and nowhere else: none of them imports what stands above it.

`_core._face` holds functions by name. What takes long to import is imported when it is called.
"""

from __future__ import annotations

from typing import Any

from . import _core
from .dynamics.threads import shared_out, thread_count
from .models.embedded_loops import embedded, source_again
from .models.multibody import Multibody, describe
from .operators import loop_letters, operator_set
from .operators.block_view import block_view
from .operators.explanation import Explanation, explain
from .operators.shown_expression import expression_latex, formula_latex


def algorithm(expression: _core.Operator | _core.Scalar, language: str = "text", request: str = "apply") -> Any:
    """`Operator.algorithm`, `Scalar.algorithm`, and the typed formulas of an operator set."""
    from .recursions import algorithm as written

    return written(expression, language, request)


def animate(expression: _core.Operator | _core.Scalar, x: Any, on: str, request: str) -> Any:
    """`Operator.animate`, `Operator.play` and `Scalar.animate`."""
    from .view import SweepFilm

    return SweepFilm(expression, x, on, request)


def certify_expression(*arguments: Any, **options: Any) -> Any:
    """`Operator.certify` and `Scalar.certify`."""
    from .accuracy.certificates.certify import certify_expression as certify

    return certify(*arguments, **options)


def certify_dynamics(*arguments: Any, **options: Any) -> Any:
    """`Multibody.certify`."""
    from .accuracy.certificates.certify import certify_dynamics as certify

    return certify(*arguments, **options)


def compile_call(*arguments: Any, **options: Any) -> Any:
    """`Multibody.compile`."""
    from .compiled import compile_call as compiled

    return compiled(*arguments, **options)


def compile_expression(*arguments: Any, **options: Any) -> Any:
    """`Operator.compile` and `Scalar.compile`."""
    from .compiled import compile_expression as compiled

    return compiled(*arguments, **options)


def dof_shares(*arguments: Any) -> Any:
    """`Multibody.dof_shares`."""
    from .view.shares import dof_shares as shares

    return shares(*arguments)


def linked_blocks(view: Any, on: str) -> Any:
    """`BlockView.on_robot`."""
    from .view.linked_blocks import LinkedBlocks

    return LinkedBlocks(view, on)


def model_html(model: Any) -> str:
    """`Multibody._repr_html_`."""
    from .view.model_picture import model_html as shown

    return shown(model)


def plan_html(explanation: Explanation) -> str:
    """`Explanation._repr_html_`."""
    from .view.plan_picture import plan_html as shown

    return shown(explanation)


def play_smoother(*arguments: Any) -> Any:
    """`StateSpace.play`."""
    from .view.kalman_page import play_smoother as play

    return play(*arguments)


def plot_model(*arguments: Any, **options: Any) -> Any:
    """`Multibody.plot`."""
    from .view import plot_model as plot

    return plot(*arguments, **options)


def check_model(*arguments: Any, **options: Any) -> Any:
    """`OperatorSet.check`."""
    from .identities.checker import check_model as check

    return check(*arguments, **options)


def rerootings(*arguments: Any) -> Any:
    """`Multibody.rerootings`."""
    from .view.rerooting_page import rerootings as seen

    return seen(*arguments)


def theorem_html(theorem: _core.Theorem) -> str:
    """`Theorem._repr_html_`."""
    from .identities.findings_page import theorem_html as shown

    return shown(theorem)


def solve_ik(*arguments: Any, **options: Any) -> Any:
    """`Multibody.solve_ik`."""
    from .kinematics import solve_ik as solve

    return solve(*arguments, **options)


def view_scene(*arguments: Any, **options: Any) -> Any:
    """`Scene.view`."""
    from .viewer import view_scene as view

    return view(*arguments, **options)


def view_model(*arguments: Any, **options: Any) -> Any:
    """`Multibody.view`."""
    from .viewer import view_model as view

    return view(*arguments, **options)


def attach() -> None:
    """Puts the functions where the core and the lower rooms find them."""
    _core._face.update(
        algorithm=algorithm,
        animate=animate,
        block_view=block_view,
        certify_dynamics=certify_dynamics,
        certify_expression=certify_expression,
        check_model=check_model,
        compile_call=compile_call,
        compile_expression=compile_expression,
        describe=describe,
        dof_shares=dof_shares,
        embedded=embedded,
        embedded_source=source_again,
        exact_numbers=operator_set.exact_numbers,
        explain=explain,
        expression_latex=expression_latex,
        formula_latex=formula_latex,
        linked_blocks=linked_blocks,
        loop_source=loop_letters.loop_source,
        model_from_description=Multibody.from_description,
        model_html=model_html,
        operator_from_nodes=operator_set.operator_from_nodes,
        plan_html=plan_html,
        play_smoother=play_smoother,
        plot_model=plot_model,
        rerootings=rerootings,
        scalar_at=operator_set.scalar_at,
        scalar_gradient=operator_set.scalar_gradient,
        shared_out=shared_out,
        solve_ik=solve_ik,
        theorem_html=theorem_html,
        thread_count=thread_count,
        view_model=view_model,
        view_scene=view_scene,
    )
