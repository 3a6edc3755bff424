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
    arm.forward_dynamics()                   # numbers and no algebra, at the present state

`arm.soa?` lists the operators, docs/notation.md their letters; `pc.Multibody` has the direct calls; on the command line, `pycraft tour`.
"""

import importlib.util
import pkgutil

# In a source checkout the folder `pycraft` hides the installed package: its compiled core is found all the same.
if importlib.util.find_spec("pycraft._core") is None:
    __path__ = pkgutil.extend_path(__path__, __name__)
del importlib, pkgutil  # no names of the workbench

from . import _core, interop, models, robots
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
    vector,
    zero,
)
from .accuracy.table import accuracy
from .accuracy.work_precision import work_precision
from .bare_trees import sko_model
from .identities import UndecidedError, check, truth
from .interop import compare
from .kalman import kalman
from .models.generators import chain, tree
from .models.load import load
from .models.multibody import Multibody
from .models.state import State
from .models.warning import ModelWarning
from .operators import OperatorSet
from .symbolic import (
    Exercise,
    Proof,
    derivative,
    exercise,
    from_sympy,
    parse,
    prove,
    prove_derivative,
    repair,
    symbolic,
    to_sympy,
    worksheet,
)

__version__ = "0.1.0"


def cmake_dir() -> str:
    """The folder of `pycraftConfig.cmake`, for C++ users: ``cmake -Dpycraft_DIR=...`` finds `pycraft::core` there."""
    from pathlib import Path

    return str(Path(_core.__file__).parent / "lib" / "cmake" / "pycraft")


__all__ = [
    "Error",
    "EvaluationError",
    "Exercise",
    "ModelError",
    "ModelWarning",
    "Multibody",
    "Operator",
    "OperatorSet",
    "Proof",
    "RefinementError",
    "Scalar",
    "SingularHingeError",
    "SingularOperatorError",
    "Space",
    "SpaceError",
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
    "euclidean",
    "exercise",
    "from_sympy",
    "identity",
    "interop",
    "kalman",
    "load",
    "models",
    "parse",
    "prove",
    "prove_derivative",
    "repair",
    "robots",
    "sko_model",
    "symbolic",
    "to_sympy",
    "tree",
    "truth",
    "vector",
    "work_precision",
    "worksheet",
    "zero",
]
