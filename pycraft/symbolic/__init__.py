"""The algebra as formulas: closed forms of small mechanisms, the bridge to SymPy."""

from .closed_forms import ClosedForms as ClosedForms
from .closed_forms import symbolic as symbolic
from .derivative import derivative as derivative
from .exercise import Exercise as Exercise
from .exercise import Judgement as Judgement
from .exercise import exercise as exercise
from .proof import Proof as Proof
from .prove import prove as prove
from .prove import prove_derivative as prove_derivative
from .repair import Repairs as Repairs
from .repair import repair as repair
from .sympy_bridge import from_sympy as from_sympy
from .sympy_bridge import parse as parse
from .sympy_bridge import to_sympy as to_sympy
from .worksheet import worksheet as worksheet
