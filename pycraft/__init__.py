"""PyCraft: an interactive workbench for the Spatial Operator Algebra over a DARTS-style multibody model.

What to type::

    import pycraft as pc
    arm = pc.robots.panda()                  # or pc.load("arm.urdf"), pc.chain(10), pc.Multibody("mine") built body by body
    arm.q = arm.random_state(seed=0).q
    H, phi, M, D, K, psi, I = arm.soa("H phi M D K psi I")
    MM = H @ phi @ M @ phi.T @ H.T           # typed as on paper; nothing is computed yet
    MM.inv() @ [1, 0, 0, 0, 0, 0, 0]         # O(N): the theorems find [I-HψK]* D⁻¹ [I-HψK]
    MM.inv().explain()                       # how, and what it costs
    pc.check("inv(psi) == inv(phi) + K*H", arm)        # is it true?
    pc.prove("inv(MM) == (I - H*psi*K).T * inv(D) * (I - H*psi*K)", model=arm)   # and why?
    arm.forward_dynamics()                   # values without algebra, at the present state

`arm.soa?` lists the operators, docs/notation.md their letters; `pc.Multibody` has the direct calls; on the command line, `pycraft tour`.
"""

import importlib.util
import pkgutil
from importlib import import_module as _import_module
from typing import TYPE_CHECKING as _TYPE_CHECKING

# In a source checkout the folder `pycraft` hides the installed package: find its compiled core all the same.
if importlib.util.find_spec("pycraft._core") is None:
    __path__ = pkgutil.extend_path(__path__, __name__)
del importlib, pkgutil  # not names of the workbench

from . import _core, face, interop, models
from ._core import (
    Error,
    EvaluationError,
    ModelError,
    Operator,
    RefinementError,
    Scalar,
    SingularHingeError,
    SingularOperatorError,
    Space,
    SpaceError,
    StaleOperatorError,
    blockdiag,
    constant,
    euclidean,
    identity,
    instruction_set,
    vector,
    zero,
)
from .kalman import kalman
from .models.bare_trees import sko_model
from .models.generators import chain, tree
from .models.multibody import Multibody
from .models.warning import ModelWarning
from .operators import OperatorSet
from .state import State

face.attach()
del face
_import_module(f"{__name__}.accuracy")
del globals()["accuracy"]  # the subpackage, imported here so that no later import of it hides the function of the same name

if _TYPE_CHECKING:
    from .accuracy.tables.table import accuracy
    from .accuracy.tables.work_precision import work_precision
    from .closed_forms import symbolic
    from .ensembles import load_sweep, samples, sweep
    from .identities import UndecidedError, check, truth
    from .models import robots
    from .models.loaders import load
    from .models.splines import Spline
    from .peers import compare
    from .proofs import Exercise, Proof, derivative, exercise, prove, prove_derivative, repair, worksheet
    from .scenes import Checkpoint, Event, Scene, effects, load_run, load_scene, mechanisms
    from .scenes.loop_comparison import loops_compared
    from .sympy_bridge import from_sympy, parse, to_sympy
    from .view.hypothesis_page import hypothesis_switches

# Modules that take long to import are imported on first use: the same names, each with its module.
_LATER = {
    "accuracy.tables.table": ("accuracy",),
    "accuracy.tables.work_precision": ("work_precision",),
    "closed_forms": ("symbolic",),
    "ensembles": ("load_sweep", "samples", "sweep"),
    "identities": ("UndecidedError", "check", "truth"),
    "models.loaders": ("load",),
    "models.robots": ("robots",),
    "models.splines": ("Spline",),
    "peers": ("compare",),
    "proofs": ("Exercise", "Proof", "derivative", "exercise", "prove", "prove_derivative", "repair", "worksheet"),
    "scenes": ("Checkpoint", "Event", "Scene", "effects", "load_run", "load_scene", "mechanisms"),
    "scenes.loop_comparison": ("loops_compared",),
    "sympy_bridge": ("from_sympy", "parse", "to_sympy"),
    "view.hypothesis_page": ("hypothesis_switches",),
}


if not _TYPE_CHECKING:  # types see the names above, and no others

    def __getattr__(name):
        for room, names in _LATER.items():
            if name in names:
                module = _import_module(f"{__name__}.{room}")
                globals()[name] = found = getattr(module, name, module)  # the robots are a module themselves
                return found
        from .other_names import remedy

        said = "" if name.startswith("_") else remedy("pycraft", name)
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}{said}")

    def __dir__():
        return sorted({*globals(), *__all__})


__version__ = "0.1.0"


def cmake_dir() -> str:
    """Return the folder of `pycraftConfig.cmake`, for C++ users: ``cmake -Dpycraft_DIR=...`` finds `pycraft::core` there."""
    from pathlib import Path

    return str(Path(_core.__file__).parent / "lib" / "cmake" / "pycraft")


__all__ = [
    "Checkpoint",
    "Error",
    "EvaluationError",
    "Event",
    "Exercise",
    "ModelError",
    "ModelWarning",
    "Multibody",
    "Operator",
    "OperatorSet",
    "Proof",
    "RefinementError",
    "Scalar",
    "Scene",
    "SingularHingeError",
    "SingularOperatorError",
    "Space",
    "SpaceError",
    "Spline",
    "StaleOperatorError",
    "State",
    "UndecidedError",
    "accuracy",
    "blockdiag",
    "chain",
    "check",
    "cmake_dir",
    "compare",
    "constant",
    "derivative",
    "effects",
    "euclidean",
    "exercise",
    "from_sympy",
    "hypothesis_switches",
    "identity",
    "instruction_set",
    "interop",
    "kalman",
    "load",
    "load_run",
    "load_scene",
    "load_sweep",
    "loops_compared",
    "mechanisms",
    "models",
    "parse",
    "prove",
    "prove_derivative",
    "repair",
    "robots",
    "samples",
    "sko_model",
    "sweep",
    "symbolic",
    "to_sympy",
    "tree",
    "truth",
    "vector",
    "work_precision",
    "worksheet",
    "zero",
]
