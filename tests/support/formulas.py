"""Formulas that are typed once and evaluated twice: by the package as an expression, by dense NumPy as an array.

A `Formula` carries the expression (`op`), the dense array of the same formula (`value`), built by NumPy's own products, sums
and inverses from the oracle's letters, and `error`, a bound in the Frobenius norm on what rounding may make of the formula in
either way of evaluation. The bound is carried along by first-order rules, so no test needs a tolerance of its own:

    letter     n_s ε g ‖X‖, n_s = 48 · (bodies on the longest path) roundings of a sweep, both ways counted,
               g = ‖φ‖/√n ≥ 1 the growth over the tree, times the amplification of the Riccati sweep for P, D, G, K, ψ, ...
    A B        ‖A‖ e(B) + e(A) ‖B‖ + n ε ‖A‖ ‖B‖, n the inner dimension
    A + B      e(A) + e(B) + ε (‖A‖ + ‖B‖)
    A⁻¹        ‖A⁻¹‖² (e(A) + n ε ‖A‖), whatever backward stable way is taken
    A^½        ‖A^-½‖ (e(A) + n ε ‖A‖)
    ln|det A|  ‖A⁻¹‖ (e(A) + n ε ‖A‖) √n

The theorems may replace a formula by another that is equal to it; its rounding obeys the same rules up to the factor `SLACK`.
"""

import numpy as np

import pycraft as pc
from support.oracle import reference

EPS = np.finfo(float).eps
SLACK = 8.0
RICCATI = {"P", "P_plus", "D", "G", "K", "tau", "tau_bar", "E_psi", "psi", "psi_tilde", "Upsilon", "Omega", "Lambda"}
LETTERS = "E phi phi_tilde H M J R P P_plus D G K tau tau_bar E_psi psi psi_tilde Upsilon Omega".split()


def norm(x):
    """Frobenius norm; that of a number its size."""
    return float(np.linalg.norm(x)) if np.size(x) else 0.0


def amplification(o):
    """max_i (HRH* + J)_ii (D⁻¹)_ii: a hinge's locked inertia over its free one, what the downdate of P loses."""
    if not len(o.D):
        return 1.0
    return float(max(1.0, (np.diag(o.H @ o.R @ o.H.T + o.J) * np.diag(np.linalg.inv(o.D))).max()))


def depth(parents):
    """Bodies on the longest path to the base."""
    depths = []
    for p in parents:
        depths.append(1 + (depths[p] if p >= 0 else 0))
    return max([1, *depths])


def blocks_only(value, rows, columns):
    """The diagonal blocks of an array, body by body; rows and columns as lists of (label, slice, body)."""
    kept = np.zeros_like(value)
    for _, r, body in rows:
        for _, c, other in columns:
            if body == other:
                kept[r, c] = value[r, c]
    return kept


class Formula:
    """One formula: the expression `op`, its dense `value` and the bound `error` on the rounding of either."""

    def __init__(self, op, value, error):
        self.op, self.value, self.error = op, value, float(error)

    # A floating identity has a number for its value; it becomes a multiple of the unit matrix when it meets an array.
    def _like(self, other):
        if np.ndim(self.value) == 0 and np.ndim(other.value) == 2:
            return Formula(self.op, self.value * np.eye(len(other.value)), self.error)
        return self

    def __matmul__(self, other):
        matrices = np.ndim(self.value) and np.ndim(other.value)
        inner = len(other.value) if matrices else 1
        size = norm(self.value) * norm(other.value)
        error = norm(self.value) * other.error + self.error * norm(other.value) + inner * EPS * size
        return Formula(self.op @ other.op, self.value @ other.value if matrices else self.value * other.value, error)

    def __mul__(self, other):
        if isinstance(other, Formula):
            made = self @ other
            return Formula(self.op * other.op, made.value, made.error)
        return Formula(self.op * other, self.value * other, abs(other) * self.error + EPS * abs(other) * norm(self.value))

    def __rmul__(self, number):
        made = self * number
        return Formula(number * self.op, made.value, made.error)

    def __truediv__(self, number):
        return Formula(self.op / number, self.value / number, self.error / abs(number) + EPS * norm(self.value) / abs(number))

    def _sum(self, other, sign, op):
        a, b = self._like(other), other._like(self)
        return Formula(op, a.value + sign * b.value, a.error + b.error + EPS * (norm(a.value) + norm(b.value)))

    def __add__(self, other):
        return self._sum(other, 1, self.op + other.op)

    def __sub__(self, other):
        return self._sum(other, -1, self.op - other.op)

    def __neg__(self):
        return Formula(-self.op, -self.value, self.error)

    def __pow__(self, n):
        factor = self if n > 0 else self.inv()
        made = factor
        for _ in range(abs(n) - 1):
            made = made @ factor
        return Formula(self.op**n, made.value, made.error)

    @property
    def T(self):
        return Formula(self.op.T, np.transpose(self.value), self.error)

    def inv(self):
        if np.ndim(self.value) == 0:
            return Formula(self.op.inv(), 1 / self.value, self.error)
        inverse = np.linalg.inv(self.value)
        return Formula(self.op.inv(), inverse, norm(inverse) ** 2 * (self.error + len(inverse) * EPS * norm(self.value)))

    def blockdiag(self):
        return Formula(pc.blockdiag(self.op), blocks_only(self.value, self.op.codomain.blocks, self.op.domain.blocks), self.error)

    def sqrt(self):
        root = np.zeros_like(self.value)
        for _, s, _ in self.op.codomain.blocks:
            root[s, s] = np.linalg.cholesky(self.value[s, s])
        error = norm(np.linalg.inv(root)) * (self.error + len(root) * EPS * norm(self.value))
        return Formula(self.op.sqrt(), root, error)

    # ------------------------------------------------------------------ what the package makes of it, against the dense value
    @property
    def bound(self):
        """The largest difference that rounding explains, one multiplication of the dense array by a vector included."""
        return SLACK * self.error + 4 * max([1, *np.shape(self.value)]) * EPS * norm(self.value)

    def assert_close(self, actual, expected=None, times=1.0):
        """`actual` is the value (or `expected`, a linear map of it that grows errors at most `times`) within the bound."""
        expected = self.value if expected is None else expected
        assert np.shape(actual) == np.shape(expected)
        off = np.abs(np.asarray(actual) - expected).max(initial=0.0)
        assert off <= times * self.bound, f"{self.op.text()}: off by {off:.2e}, bound {times * self.bound:.2e}"

    def assert_applies(self, rng, columns=3):
        """op @ x and op.T @ y, for one vector and several."""
        rows, n = self.value.shape
        for shape, size in (((n,), 1), ((n, columns), columns)):
            x, y = rng.uniform(-1, 1, shape), rng.uniform(-1, 1, (rows, *shape[1:]))
            self.assert_close(self.op @ x, self.value @ x, np.sqrt(n * size))
            self.assert_close(self.op.T @ y, self.value.T @ y, np.sqrt(rows * size))

    def assert_reductions(self):
        """Trace and ln|det| of a square formula, its diagonal: each of n entries, or moved by tr(A⁻¹ δA)."""
        n = len(self.value)
        self.assert_close(self.op.diagonal(), np.diag(self.value))
        self.assert_close(float(self.op.trace()), np.trace(self.value), n)
        self.assert_logdet()

    def assert_logdet(self):
        n, inverse = len(self.value), norm(np.linalg.inv(self.value)) if len(self.value) else 0.0
        moved = SLACK * inverse * (self.error + n * EPS * norm(self.value)) * np.sqrt(max(n, 1)) + n * EPS
        off = abs(float(self.op.logdet()) - np.linalg.slogdet(self.value)[1])
        assert off <= moved, f"ln|det({self.op.text()})|: off by {off:.2e}, bound {moved:.2e}"


class Letters:
    """The letters of one operator set as formulas: values from the oracle `o`, at the state that it was made for."""

    def __init__(self, soa, o):
        self.soa, self.o = soa, o
        self._sweep = 48 * depth(o.parents) * EPS * max(1.0, norm(o.phi) / np.sqrt(max(len(o.phi), 1)))
        self._grown = self._sweep * amplification(o)

    def error(self, name, value):
        """The bound of a letter's own rounding: relative to its size, or to that of what cancels in it."""
        o = self.o
        cancels = {
            "H_dot": lambda: norm(o.H) ** 2 * norm(o.v),
            "P_plus": lambda: norm(o.P),
            "tau_bar": lambda: norm(o.I) + norm(o.tau),
            "E_psi": lambda: norm(o.E) * (1 + norm(o.tau)),
            "psi_tilde": lambda: norm(o.E) * (1 + norm(o.tau)) * norm(o.psi),
        }
        size = max(norm(value), cancels[name]() if name in cancels else 0.0)
        return (self._grown if name in RICCATI else self._sweep) * size

    def formula(self, op, value, name=""):
        return Formula(op, value, self.error(name, value))

    def __getattr__(self, name):
        if name.startswith("_"):
            raise AttributeError(name)
        value = getattr(self.o, name)
        if name in ("B", "Jacobian", "Lambda", "Delta"):
            made = getattr(self.soa, name)
            return lambda argument: self.formula(made(argument), value(argument), name)
        return self.formula(getattr(self.soa, name), value, name)

    def __call__(self, names):
        return tuple(getattr(self, name) for name in names.split())

    @property
    def I(self):
        return Formula(self.soa.I, 1.0, 0.0)

    def constant(self, array, domain, codomain, name="C"):
        """A constant given as a matrix, a diagonal or a list of blocks."""
        if isinstance(array, list):
            dense = np.zeros((len(codomain), len(domain)))
            for block, (_, r, _), (_, c, _) in zip(array, codomain.blocks, domain.blocks, strict=True):
                dense[r, c] = block
        else:
            dense = np.diag(array) if np.ndim(array) == 1 else np.asarray(array, float)
        return Formula(pc.constant(array, domain, codomain, name), dense, 0.0)

    @property
    def MM(self):
        """ℳ = HφMφ*H*."""
        H, phi, M = self("H phi M")
        return H @ phi @ M @ phi.T @ H.T


def letters_of(model, q=None, v=None):
    """The letters of a multibody model at a state (its present one if left out), against the rigid oracle."""
    q, v = (model.q if q is None else q), (model.v if v is None else v)
    return Letters(model.soa, reference.operators(model.description(), q, v))
