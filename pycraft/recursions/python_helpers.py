"""Helpers that generated Python brings along: name, what each needs, text; in the order in which they are written."""

HELPERS: dict[str, tuple[tuple[str, ...], str]] = {
    "solve": (
        (),
        '''
def solve(A, b):
    """A⁻¹ b."""
    return np.linalg.solve(A, b) if A.size else b
''',
    ),
    "inverse": (
        (),
        '''
def inverse(A):
    """A⁻¹."""
    return np.linalg.inv(A) if A.size else A
''',
    ),
    "symmetric": (
        (),
        '''
def symmetric(A):
    """A without the rounding that makes it unsymmetric."""
    return (A + A.T) / 2
''',
    ),
    "cut": (
        (),
        '''
def cut(x, rows):
    """A vector (or columns) body by body."""
    return [x[r] for r in rows]
''',
    ),
    "stack": (
        (),
        '''
def stack(y, rows, columns):
    """Blocks body by body as one vector (or columns)."""
    out = np.zeros((sum(map(len, rows)), columns))
    for block, r in zip(y, rows):
        out[r] = block
    return out
''',
    ),
    "assembled": (
        (),
        '''
def assembled(B, rows, columns):
    """Blocks on the diagonal of a matrix."""
    out = np.zeros((sum(map(len, rows)), sum(map(len, columns))))
    for block, r, c in zip(B, rows, columns):
        out[np.ix_(r, c)] = block
    return out
''',
    ),
    "skew": (
        (),
        '''
def skew(w):
    """w̃: w̃ x = w × x."""
    return np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
''',
    ),
    "crm": (
        ("skew",),
        '''
def crm(V):
    """[[ω̃, 0], [ṽ, ω̃]]: the cross product of motions."""
    w, v = skew(V[:3, 0]), skew(V[3:, 0])
    return np.block([[w, np.zeros((3, 3))], [v, w]])
''',
    ),
    "crf": (
        ("skew",),
        '''
def crf(V):
    """[[ω̃, ṽ], [0, ω̃]]: the cross product of a motion with forces."""
    w, v = skew(V[:3, 0]), skew(V[3:, 0])
    return np.block([[w, v], [np.zeros((3, 3)), w]])
''',
    ),
    "cross_of_momentum": (
        ("skew",),
        '''
def cross_of_momentum(h):
    """-[[ñ, f̃], [f̃, 0]] of a momentum (n; f)."""
    n, f = skew(h[:3, 0]), skew(h[3:, 0])
    return -np.block([[n, f], [f, np.zeros((3, 3))]])
''',
    ),
    "root": (
        (),
        '''
def root(A):
    """L, lower triangular, with A = L L*; columns of zeros where A is singular."""
    L = np.zeros_like(A)
    bound = 16 * len(A) * np.finfo(float).eps * max(np.diag(A), default=0)
    for j in range(len(A)):
        pivot = A[j, j] - L[j, :j] @ L[j, :j]
        if pivot < -bound:
            raise ValueError("a block is not positive semidefinite: it has no square root")
        if pivot > bound:
            L[j, j] = np.sqrt(pivot)
            L[j + 1 :, j] = (A[j + 1 :, j] - L[j + 1 :, :j] @ L[j, :j]) / L[j, j]
    return L
''',
    ),
    "lower_half": (
        (),
        '''
def lower_half(A):
    """The lower triangle of A with half its diagonal."""
    return np.tril(A) - np.diag(np.diag(A)) / 2
''',
    ),
    "diagonal": (
        (),
        '''
def diagonal(A):
    """The diagonal, as a column."""
    return np.diag(A)[:, None]
''',
    ),
    "trace": ((), "\n\ntrace = np.trace\n"),
    "norm": ((), "\n\nnorm = np.linalg.norm\n"),
    "square_root": (
        (),
        '''
def square_root(x):
    """√x; what rounding left below zero is zero."""
    return np.sqrt(max(x, 0))
''',
    ),
    "logdet": (
        (),
        '''
def logdet(A):
    """ln|det A|."""
    return np.linalg.slogdet(A)[1] if A.size else 0.0
''',
    ),
    "TreeSystem": (
        ("solve", "inverse", "logdet"),
        '''
class TreeSystem:
    """T s = b, its unknowns the states of bodies, coupled to the parent p and the children c alone, and a border b, coupled to all.

    sizes[k] are the sizes of body k's states, border those of the border's (0 where a state is of the other kind).
    """

    def __init__(self, parent, sizes, border):
        self.parent, self.n = parent, len(parent)
        self.children = [[c for c, p in enumerate(parent) if p == k] for k in range(self.n)]
        self.start = [np.concatenate([[0], np.cumsum(s)]).astype(int) for s in [*sizes, border]]  # the border is the last
        s = [a[-1] for a in self.start]
        of_parent = [s[p] if p >= 0 else 0 for p in parent]
        self.T_own = [np.zeros((s[k], s[k])) for k in range(self.n)]  # T(k,k)
        self.T_up = [np.zeros((of_parent[k], s[k])) for k in range(self.n)]  # T(p,k)
        self.T_down = [np.zeros((s[k], of_parent[k])) for k in range(self.n)]  # T(k,p)
        self.T_right = [np.zeros((s[k], s[-1])) for k in range(self.n)]  # T(k,b)
        self.T_below = [np.zeros((s[-1], s[k])) for k in range(self.n)]  # T(b,k)
        self.T_corner = np.zeros((s[-1], s[-1]))  # T(b,b)
        self.pivots = None

    def _rows(self, k, i):
        return slice(self.start[k][i], self.start[k][i + 1])

    # Blocks of equation i and state j, to be added to.
    def own(self, k, i, j):
        return self.T_own[k][self._rows(k, i), self._rows(k, j)]

    def up(self, k, i, j):
        return self.T_up[k][self._rows(self.parent[k], i), self._rows(k, j)]

    def down(self, k, i, j):
        return self.T_down[k][self._rows(k, i), self._rows(self.parent[k], j)]

    def right(self, k, i, j):
        return self.T_right[k][self._rows(k, i), self._rows(-1, j)]

    def below(self, k, i, j):
        return self.T_below[k][self._rows(-1, i), self._rows(k, j)]

    def corner(self, i, j):
        return self.T_corner[self._rows(-1, i), self._rows(-1, j)]

    def vector(self, columns):
        """Zeros: one block per body, the border's last."""
        return [np.zeros((a[-1], columns)) for a in self.start]

    def part(self, s, k, j):
        """State j of body k; k = -1: of the border."""
        return s[k][self._rows(k, j)]

    def factor(self):
        """Eliminates from the leaves to the root; all at once where a pivot is singular, or nearly."""
        A, U, X, Y = ([None] * self.n for _ in range(4))
        self.pivots, self.whole = (A, U, X, Y), None
        try:
            for k in reversed(range(self.n)):
                c_k = self.children[k]
                # A(k) = T(k,k) - Σ_c T(k,c) U(c), U(k) = A⁻¹(k) T(k,p)
                A[k] = self.T_own[k] - sum(self.T_up[c] @ U[c] for c in c_k)
                U[k] = solve(A[k], self.T_down[k])
                # X(k) = A⁻¹(k) (T(k,b) - Σ_c T(k,c) X(c)), Y(k) = T(b,k) - Σ_c Y(c) U(c)
                X[k] = solve(A[k], self.T_right[k] - sum(self.T_up[c] @ X[c] for c in c_k))
                Y[k] = self.T_below[k] - sum(Y[c] @ U[c] for c in c_k)
            # S = T(b,b) - Σ_k Y(k) X(k)
            self.S = self.T_corner - sum(Y[k] @ X[k] for k in range(self.n))
            known = [np.where(np.arange(a[-1])[:, None] % 3 == 1, -1.0, 1.0) for a in self.start]
            found = self.sweep(self.times(known))
            lost = max([np.abs(f - g).max(initial=0.0) for f, g in zip(found, known)])
        except np.linalg.LinAlgError:
            lost = np.inf
        if not lost < 1e-9:
            self.whole = self.dense()

    def sweep(self, b):
        """T⁻¹ b by the factors."""
        if self.whole is not None:
            at = np.cumsum([len(x) for x in b])[:-1]
            return np.split(np.linalg.solve(self.whole, np.concatenate(b)), at)
        A, U, X, Y = self.pivots
        t, s = [None] * self.n, [None] * (self.n + 1)
        for k in reversed(range(self.n)):
            # t(k) = A⁻¹(k) r(k), r(k) = b(k) - Σ_c T(k,c) t(c)
            t[k] = solve(A[k], b[k] - sum(self.T_up[c] @ t[c] for c in self.children[k]))
        s[-1] = solve(self.S, b[-1] - sum(Y[k] @ t[k] for k in range(self.n)))
        for k, p in enumerate(self.parent):
            # s(k) = t(k) - X(k) s(b) - U(k) s(p)
            s[k] = t[k] - X[k] @ s[-1] - (U[k] @ s[p] if p >= 0 else 0)
        return s

    def solve(self, b):
        """T⁻¹ b, refined once."""
        if self.pivots is None:
            self.factor()
        s = self.sweep(b)
        correction = self.sweep([x - y for x, y in zip(b, self.times(s))])
        return [x + y for x, y in zip(s, correction)]

    def times(self, s):
        """T s."""
        b = [self.T_own[k] @ s[k] + self.T_right[k] @ s[-1] for k in range(self.n)]
        b.append(self.T_corner @ s[-1])
        for k, p in enumerate(self.parent):
            b[-1] = b[-1] + self.T_below[k] @ s[k]
            if p >= 0:
                b[k] = b[k] + self.T_down[k] @ s[p]
                b[p] = b[p] + self.T_up[k] @ s[k]
        return b

    def dense(self):
        """T as one matrix, the border last."""
        at = np.concatenate([[0], np.cumsum([a[-1] for a in self.start])])
        T = np.zeros((at[-1], at[-1]))
        rows = [slice(at[k], at[k + 1]) for k in range(self.n + 1)]
        for k, p in enumerate(self.parent):
            T[rows[k], rows[k]] = self.T_own[k]
            T[rows[k], rows[-1]], T[rows[-1], rows[k]] = self.T_right[k], self.T_below[k]
            if p >= 0:
                T[rows[p], rows[k]], T[rows[k], rows[p]] = self.T_up[k], self.T_down[k]
        T[rows[-1], rows[-1]] = self.T_corner
        return T

    def logdet(self):
        """ln|det T| from the pivots."""
        if self.pivots is None:
            self.factor()
        if self.whole is not None:
            return logdet(self.whole)
        return sum(logdet(a) for a in self.pivots[0]) + logdet(self.S)

    def inverse(self):
        """The diagonal blocks Z(k,k) of T⁻¹, base to tip."""
        if self.pivots is None:
            self.factor()
        if self.whole is not None:
            Z, at = inverse(self.whole), np.concatenate([[0], np.cumsum([a[-1] for a in self.start])])
            return [Z[at[k] : at[k + 1], at[k] : at[k + 1]] for k in range(self.n)]
        A, U, X, Y = self.pivots
        Z, Z_right, Z_below = ([None] * self.n for _ in range(3))
        S_inverse = inverse(self.S)
        for k, p in enumerate(self.parent):
            A_inverse = inverse(A[k])
            F, over = X[k] @ S_inverse, S_inverse @ Y[k] @ A_inverse
            if p < 0:
                Z[k] = A_inverse + F @ Y[k] @ A_inverse
            else:
                # N = T(p,k) A⁻¹(k), F = U(k) Z(p,b) + X(k) Z(b,b)
                N = self.T_up[k] @ A_inverse
                F, over = F + U[k] @ Z_right[p], over + Z_below[p] @ N
                # Z(k,k) = A⁻¹(k) + (U(k) Z(p,p) + X(k) Z(b,p)) N + F Y(k) A⁻¹(k)
                Z[k] = A_inverse + (U[k] @ Z[p] + X[k] @ Z_below[p]) @ N + F @ Y[k] @ A_inverse
            Z_right[k], Z_below[k] = -F, -over  # Z(k,b), Z(b,k)
        return Z

    def block(self, Z, k, j, i):
        """Block (state j, equation i) of Z(k,k)."""
        return Z[k][self._rows(k, j), self._rows(k, i)]
''',
    ),
    "ranges": (
        (),
        '''
def ranges(sizes):
    """The rows of each body where bodies follow each other."""
    ends = np.cumsum(sizes).astype(int)
    return [np.arange(end - size, end) for end, size in zip(ends, sizes)]
''',
    ),
    "blocks": (
        (),
        '''
def blocks(given, rows, columns):
    """Blocks as arrays of their shapes; None where there is none."""
    return [None if b is None else np.asarray(b, float).reshape(len(r), len(c)) for b, r, c in zip(given, rows, columns)]
''',
    ),
}
