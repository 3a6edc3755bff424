"""The equations of a realization over a tree, eliminated body by body."""

import numpy as np

from .matrices import inverse, logdet, solve


class TreeSystem:
    """T s = b, with the states of bodies as unknowns, coupled only to the parent p and the children c, and a border b, coupled to all.

    sizes[k] are the sizes of body k's states, border the sizes of the border's states (0 for a state of the other kind).
    """

    def __init__(self, parent: list[int], sizes: list[list[int]], border: list[int]):
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
        self.factored = False
        self.pivots = tuple([np.empty((0, 0))] * self.n for _ in range(4))  # A, U, X, Y
        self.S = self.T_corner
        self.whole: np.ndarray | None = None  # T, if it is solved all at once

    def _rows(self, k: int, i: int) -> slice:
        return slice(self.start[k][i], self.start[k][i + 1])

    # Blocks of equation i and state j, to be added to.
    def own(self, k: int, i: int, j: int) -> np.ndarray:
        return self.T_own[k][self._rows(k, i), self._rows(k, j)]

    def up(self, k: int, i: int, j: int) -> np.ndarray:
        return self.T_up[k][self._rows(self.parent[k], i), self._rows(k, j)]

    def down(self, k: int, i: int, j: int) -> np.ndarray:
        return self.T_down[k][self._rows(k, i), self._rows(self.parent[k], j)]

    def right(self, k: int, i: int, j: int) -> np.ndarray:
        return self.T_right[k][self._rows(k, i), self._rows(-1, j)]

    def below(self, k: int, i: int, j: int) -> np.ndarray:
        return self.T_below[k][self._rows(-1, i), self._rows(k, j)]

    def corner(self, i: int, j: int) -> np.ndarray:
        return self.T_corner[self._rows(-1, i), self._rows(-1, j)]

    def vector(self, columns: int) -> list[np.ndarray]:
        """Zeros: one block per body, the border's last."""
        return [np.zeros((a[-1], columns)) for a in self.start]

    def part(self, s: list[np.ndarray], k: int, j: int) -> np.ndarray:
        """State j of body k; k = -1: of the border."""
        return s[k][self._rows(k, j)]

    def factor(self) -> None:
        """Eliminate from the leaves to the root; all at once if a pivot is singular, or nearly."""
        if self.factored:
            return
        self.factored = True
        A, U, X, Y = self.pivots
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
            lost = max([np.abs(f - g).max(initial=0.0) for f, g in zip(found, known, strict=True)])
        except np.linalg.LinAlgError:
            lost = np.inf
        if not lost < 1e-9:
            self.whole = self.dense()

    def sweep(self, b: list[np.ndarray]) -> list[np.ndarray]:
        """T⁻¹ b by the factors."""
        if self.whole is not None:
            at = np.cumsum([len(x) for x in b])[:-1]
            return np.split(np.linalg.solve(self.whole, np.concatenate(b)), at)
        A, U, X, Y = self.pivots
        t, s = list(b[:-1]), list(b)
        for k in reversed(range(self.n)):
            # t(k) = A⁻¹(k) r(k), r(k) = b(k) - Σ_c T(k,c) t(c)
            t[k] = solve(A[k], b[k] - sum(self.T_up[c] @ t[c] for c in self.children[k]))
        s[-1] = solve(self.S, b[-1] - sum(Y[k] @ t[k] for k in range(self.n)))
        for k, p in enumerate(self.parent):
            # s(k) = t(k) - X(k) s(b) - U(k) s(p)
            s[k] = t[k] - X[k] @ s[-1] - (U[k] @ s[p] if p >= 0 else 0)
        return s

    def solve(self, b: list[np.ndarray]) -> list[np.ndarray]:
        """T⁻¹ b, refined once."""
        self.factor()
        s = self.sweep(b)
        correction = self.sweep([x - y for x, y in zip(b, self.times(s), strict=True)])
        return [x + y for x, y in zip(s, correction, strict=True)]

    def times(self, s: list[np.ndarray]) -> list[np.ndarray]:
        """T s."""
        b = [self.T_own[k] @ s[k] + self.T_right[k] @ s[-1] for k in range(self.n)]
        b.append(self.T_corner @ s[-1])
        for k, p in enumerate(self.parent):
            b[-1] = b[-1] + self.T_below[k] @ s[k]
            if p >= 0:
                b[k] = b[k] + self.T_down[k] @ s[p]
                b[p] = b[p] + self.T_up[k] @ s[k]
        return b

    def dense(self) -> np.ndarray:
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

    def logdet(self) -> float:
        """ln|det T| from the pivots."""
        self.factor()
        if self.whole is not None:
            return logdet(self.whole)
        return sum(logdet(a) for a in self.pivots[0]) + logdet(self.S)

    def inverse(self) -> list[np.ndarray]:
        """The diagonal blocks Z(k,k) of T⁻¹, base to tip."""
        self.factor()
        if self.whole is not None:
            all_of_it, at = inverse(self.whole), np.concatenate([[0], np.cumsum([a[-1] for a in self.start])])
            return [all_of_it[at[k] : at[k + 1], at[k] : at[k + 1]] for k in range(self.n)]
        A, U, X, Y = self.pivots
        Z, Z_right, Z_below = ([np.empty((0, 0))] * self.n for _ in range(3))
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

    def block(self, Z: list[np.ndarray], k: int, j: int, i: int) -> np.ndarray:
        """Block (state j, equation i) of Z(k,k)."""
        return Z[k][self._rows(k, j), self._rows(k, i)]
