"""PyCraft: an interactive workbench for the Spatial Operator Algebra over a DARTS-style multibody model."""

import importlib.util
import pkgutil

# In a source checkout the folder `pycraft` hides the installed package: its compiled core is found all the same.
if importlib.util.find_spec("pycraft._core") is None:
    __path__ = pkgutil.extend_path(__path__, __name__)

from . import _core, interop, models, robots
from ._core import (
    Error,
    EvaluationError,
    ModelError,
    Operator,
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
from .identities import check
from .models.generators import chain, tree
from .models.load import load
from .models.multibody import Multibody
from .models.state import State
from .models.warning import ModelWarning
from .operators import OperatorSet, sko_model

__version__ = "0.1.0"

__all__ = [
    "Error",
    "EvaluationError",
    "ModelError",
    "ModelWarning",
    "Multibody",
    "Operator",
    "OperatorSet",
    "Scalar",
    "SingularHingeError",
    "SingularOperatorError",
    "Space",
    "SpaceError",
    "StaleOperatorError",
    "State",
    "blockdiag",
    "chain",
    "check",
    "constant",
    "euclidean",
    "identity",
    "interop",
    "load",
    "models",
    "robots",
    "sko_model",
    "tree",
    "vector",
    "zero",
]
