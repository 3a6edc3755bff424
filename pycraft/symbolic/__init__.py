"""The algebra as formulas: closed forms of small mechanisms, the bridge to SymPy."""

from .closed_forms import ClosedForms as ClosedForms
from .closed_forms import symbolic as symbolic
from .derivative import derivative as derivative
from .proof import Proof as Proof
from .prove import prove as prove
from .prove import prove_derivative as prove_derivative
