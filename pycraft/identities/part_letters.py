"""Letters of parts of a model: H_f, ψ_f, ... of the coordinates that are free, H_p of those that are prescribed; Q and A of loops; X_r.

A statement is said of any choice of prescribed hinges: here every third one is. Of operators of free
coordinates (`soa.free(...)`) the operators are theirs.
"""

from __future__ import annotations

from typing import Any

from .. import _core

_OF_PARTS = ("H", "J", "P", "P_plus", "D", "G", "K", "tau", "tau_bar", "E_psi", "psi", "psi_tilde", "Upsilon", "Omega")
_MOVED = "(M phi^* (H_f^* vdot_f + H_p^* vdot_p + a) + b)"
_MADE = {
    **{f"MM_{a}{b}": f"H_{a} phi M phi^* H_{b}^*" for a in "fp" for b in "fp"},
    **{f"Jacobian_{a}": f"phi^* H_{a}^*" for a in "fp"},
    "T_f": f"H_f phi {_MOVED} + J_f vdot_f",
    "T_p": f"H_p phi {_MOVED}",
    "z_f": "psi_f (K_f T_f + P_f (a + H_p^* vdot_p) + b)",
    "nu_f": "D_f^-1 (T_f - H_f z_f)",
}
_VECTORS = ("vdot_f", "vdot_p")
_OF_LOOPS = ("Q", "A")
_OF_GROUPS = ("X_r", "X_r_dot", "phi_S", "H_S")
HYBRID = frozenset({f"{x}_{of}" for x in _OF_PARTS for of in "fp"} | {*_MADE, *_VECTORS})
"""Names of hybrid parts."""


def part_names(operators: Any) -> frozenset[str]:
    """The names of the parts that these operators have."""
    source, model = operators._source, operators._model
    hybrid = hasattr(operators, "of_prescribed") or isinstance(source, _core.MultibodyOperators) and source.derived_from is None
    loops = getattr(model, "loops", ()) if isinstance(source, _core.MultibodyOperators) else ()
    grouped = [name for name in _OF_GROUPS if source.derived_from is not None and hasattr(operators, name)]
    return frozenset({*(HYBRID if hybrid else ()), *(_OF_LOOPS if loops is not None and len(loops) else ()), *grouped})


def text_of_part(name: str) -> str | None:
    """What a part is made of, in the grammar's spelling; None where it is a letter of its own."""
    return _MADE.get(name)


def part(operators: Any, name: str) -> Any:
    """The operator of a part.

    Raises
    ------
    ModelError
        No hinge can be prescribed.
    """
    if name not in HYBRID:
        return getattr(operators, name)
    free = operators if hasattr(operators, "of_prescribed") else _with_every_third_prescribed(operators)
    letter, of = name.rsplit("_", 1)
    own = free if of == "f" else free.of_prescribed
    return _core.vector(name, own.Theta) if name in _VECTORS else getattr(own, letter)


def _with_every_third_prescribed(operators: Any) -> Any:
    model, dof = operators._model, operators._source.dof
    named = [name for k, name in enumerate(model.hinges) if k % 3 == 1 and dof[k]] if model is not None else []
    if not named:
        raise _core.ModelError(f"{operators._source.name!r} has no second hinge that could be prescribed")
    made: Any = operators._made
    if "every third" not in made:
        made["every third"] = operators.free(named)
    return made["every third"]
