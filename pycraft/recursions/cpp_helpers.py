"""Helpers that generated C++ brings along: name, what each needs, text; in the order in which they are written."""

HELPERS: dict[str, tuple[tuple[str, ...], str]] = {
    "size": ((), "\ninline int size(const std::vector<int>& rows) { return static_cast<int>(rows.size()); }\n"),
    "children_of": (
        ("size",),
        """
inline Rows children_of(const std::vector<int>& parent) {
  Rows children(parent.size());
  for (int k = 0; k < size(parent); ++k)
    if (parent[k] >= 0) children[parent[k]].push_back(k);
  return children;
}
""",
    ),
    "matrix": (
        (),
        """
inline Matrix matrix(int rows, int columns, const std::vector<double>& entries) {
  return Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(entries.data(), rows, columns);
}
""",
    ),
    "solve": (
        (),
        """
inline Matrix solve(const Matrix& A, const Matrix& b) {  // A⁻¹ b
  return A.size() && b.size() ? Matrix(A.partialPivLu().solve(b)) : b;
}
""",
    ),
    "inverse": (("solve",), "\ninline Matrix inverse(const Matrix& A) { return solve(A, Matrix::Identity(A.rows(), A.cols())); }\n"),
    "symmetric": (
        (),
        """
inline Matrix symmetric(const Matrix& A) { return (A + A.transpose()) / 2; }  // without the rounding that makes it unsymmetric
""",
    ),
    "pick_rows": (
        ("size",),
        """
inline Matrix pick_rows(const Matrix& A, const std::vector<int>& rows) {
  Matrix out(size(rows), A.cols());
  for (int i = 0; i < size(rows); ++i) out.row(i) = A.row(rows[i]);
  return out;
}
""",
    ),
    "pick_columns": (
        ("size",),
        """
inline Matrix pick_columns(const Matrix& A, const std::vector<int>& columns) {
  Matrix out(A.rows(), size(columns));
  for (int j = 0; j < size(columns); ++j) out.col(j) = A.col(columns[j]);
  return out;
}
""",
    ),
    "put": (
        ("size",),
        """
inline void put(Matrix& A, const std::vector<int>& rows, const std::vector<int>& columns, const Matrix& block) {
  for (int i = 0; i < size(rows); ++i)
    for (int j = 0; j < size(columns); ++j) A(rows[i], columns[j]) = block(i, j);
}
""",
    ),
    "cut": (
        ("pick_rows",),
        """
inline Blocks cut(const Matrix& x, const Rows& rows) {  // a vector (or columns) body by body
  Blocks blocks;
  for (const auto& r : rows) blocks.push_back(pick_rows(x, r));
  return blocks;
}
""",
    ),
    "stack": (
        ("size",),
        """
inline Matrix stack(const Blocks& y, const Rows& rows, int columns) {  // blocks body by body as one vector (or columns)
  int total = 0;
  for (const auto& r : rows) total += size(r);
  Matrix out(total, columns);
  for (std::size_t k = 0; k < rows.size(); ++k)
    for (int i = 0; i < size(rows[k]); ++i) out.row(rows[k][i]) = y[k].row(i);
  return out;
}
""",
    ),
    "assembled": (
        ("put",),
        """
inline Matrix assembled(const Blocks& B, const Rows& rows, const Rows& columns) {  // blocks on the diagonal of a matrix
  int height = 0, width = 0;
  for (const auto& r : rows) height += size(r);
  for (const auto& c : columns) width += size(c);
  Matrix out = Matrix::Zero(height, width);
  for (std::size_t k = 0; k < B.size(); ++k) put(out, rows[k], columns[k], B[k]);
  return out;
}
""",
    ),
    "skew": (
        (),
        """
inline Eigen::Matrix3d skew(const Eigen::Vector3d& w) {  // w~ x = w × x
  Eigen::Matrix3d W;
  W << 0, -w[2], w[1], w[2], 0, -w[0], -w[1], w[0], 0;
  return W;
}
""",
    ),
    "crm": (
        ("skew",),
        """
inline Matrix crm(const Matrix& V) {  // [[ω~, 0], [v~, ω~]]: the cross product of motions
  Matrix X = Matrix::Zero(6, 6);
  X.block(0, 0, 3, 3) = X.block(3, 3, 3, 3) = skew(V.block(0, 0, 3, 1));
  X.block(3, 0, 3, 3) = skew(V.block(3, 0, 3, 1));
  return X;
}
""",
    ),
    "crf": (
        ("skew",),
        """
inline Matrix crf(const Matrix& V) {  // [[ω~, v~], [0, ω~]]: the cross product of a motion with forces
  Matrix X = Matrix::Zero(6, 6);
  X.block(0, 0, 3, 3) = X.block(3, 3, 3, 3) = skew(V.block(0, 0, 3, 1));
  X.block(0, 3, 3, 3) = skew(V.block(3, 0, 3, 1));
  return X;
}
""",
    ),
    "cross_of_momentum": (
        ("skew",),
        """
inline Matrix cross_of_momentum(const Matrix& h) {  // -[[n~, f~], [f~, 0]] of a momentum (n; f)
  Matrix X = Matrix::Zero(6, 6);
  X.block(0, 0, 3, 3) = -skew(h.block(0, 0, 3, 1));
  X.block(0, 3, 3, 3) = X.block(3, 0, 3, 3) = -skew(h.block(3, 0, 3, 1));
  return X;
}
""",
    ),
    "root": (
        (),
        """
inline Matrix root(const Matrix& A) {  // L, lower triangular, with A = L L*; columns of zeros where A is singular
  const int n = static_cast<int>(A.rows());
  Matrix L = Matrix::Zero(n, n);
  const double bound = 16 * n * std::numeric_limits<double>::epsilon() * (n ? std::max(A.diagonal().maxCoeff(), 0.0) : 0.0);
  for (int j = 0; j < n; ++j) {
    const double pivot = A(j, j) - L.row(j).head(j).squaredNorm();
    if (pivot < -bound) throw std::domain_error("a block is not positive semidefinite: it has no square root");
    if (!(pivot > bound)) continue;
    L(j, j) = std::sqrt(pivot);
    for (int i = j + 1; i < n; ++i) L(i, j) = (A(i, j) - L.row(i).head(j).dot(L.row(j).head(j))) / L(j, j);
  }
  return L;
}
""",
    ),
    "lower_half": (
        (),
        """
inline Matrix lower_half(const Matrix& A) {  // the lower triangle of A with half its diagonal
  Matrix L = A.triangularView<Eigen::Lower>();
  L.diagonal() /= 2;
  return L;
}
""",
    ),
    "diagonal": ((), "\ninline Matrix diagonal(const Matrix& A) { return A.diagonal(); }\n"),
    "trace": ((), "\ninline double trace(const Matrix& A) { return A.trace(); }\n"),
    "norm": ((), "\ninline double norm(const Matrix& A) { return A.norm(); }\n"),
    "square_root": ((), "\ninline double square_root(double x) { return std::sqrt(std::max(x, 0.0)); }\n"),
    "logdet": (
        (),
        """
inline double logdet(const Matrix& A) {  // ln|det A|
  return A.size() ? Matrix(A.partialPivLu().matrixLU()).diagonal().array().abs().log().sum() : 0.0;
}
""",
    ),
    "ranges": (
        (),
        """
inline Rows ranges(const std::vector<int>& sizes) {  // the rows of each body where bodies follow each other
  Rows rows;
  int next = 0;
  for (int size : sizes) {
    rows.emplace_back();
    for (int i = 0; i < size; ++i) rows.back().push_back(next++);
  }
  return rows;
}
""",
    ),
    "TreeSystem": (
        ("solve", "inverse", "logdet", "children_of"),
        """
// The class has functions of the same names.
inline Matrix free_solve(const Matrix& A, const Matrix& b) { return solve(A, b); }
inline Matrix free_inverse(const Matrix& A) { return inverse(A); }
inline double free_logdet(const Matrix& A) { return logdet(A); }

// T s = b, its unknowns the states of bodies, coupled to the parent p and the children c alone, and a border b, coupled to all.
// sizes[k]: the sizes of body k's states; border: those of the border's (0 where a state is of the other kind).
class TreeSystem {
 public:
  TreeSystem(const std::vector<int>& parent, Rows sizes, const std::vector<int>& border)
      : parent_(parent), children_(children_of(parent)), n_(size(parent)) {
    sizes.push_back(border);  // the border is the last
    for (const auto& s : sizes) {
      start_.push_back({0});
      for (int i : s) start_.back().push_back(start_.back().back() + i);
    }
    const auto rows = [&](int k) { return start_[k].back(); };
    for (int k = 0; k < n_; ++k) {
      const int up = parent[k] >= 0 ? rows(parent[k]) : 0;
      own_.push_back(Matrix::Zero(rows(k), rows(k)));
      up_.push_back(Matrix::Zero(up, rows(k)));
      down_.push_back(Matrix::Zero(rows(k), up));
      right_.push_back(Matrix::Zero(rows(k), rows(n_)));
      below_.push_back(Matrix::Zero(rows(n_), rows(k)));
    }
    corner_ = Matrix::Zero(rows(n_), rows(n_));
  }

  // Blocks of equation i and state j, to be added to: T(k,k), T(p,k), T(k,p), T(k,b), T(b,k), T(b,b).
  using Block = Eigen::Block<Matrix>;
  Block own(int k, int i, int j) { return view(own_[k], k, i, k, j); }
  Block up(int k, int i, int j) { return view(up_[k], parent_[k], i, k, j); }
  Block down(int k, int i, int j) { return view(down_[k], k, i, parent_[k], j); }
  Block right(int k, int i, int j) { return view(right_[k], k, i, n_, j); }
  Block below(int k, int i, int j) { return view(below_[k], n_, i, k, j); }
  Block corner(int i, int j) { return view(corner_, n_, i, n_, j); }

  Blocks vector(int columns) const {  // zeros: one block per body, the border's last
    Blocks b;
    for (const auto& s : start_) b.push_back(Matrix::Zero(s.back(), columns));
    return b;
  }
  Block part(Blocks& s, int k, int j) const {  // state j of body k; k = -1: of the border
    const int at = k < 0 ? n_ : k;
    return s[at].block(start_[at][j], 0, start_[at][j + 1] - start_[at][j], s[at].cols());
  }

  Blocks solve(const Blocks& b) {  // T⁻¹ b, refined once
    factor();
    Blocks s = sweep(b), r = times(s);
    for (int k = 0; k <= n_; ++k) r[k] = b[k] - r[k];
    r = sweep(r);
    for (int k = 0; k <= n_; ++k) s[k] += r[k];
    return s;
  }

  double logdet() {  // ln|det T| from the pivots
    factor();
    if (one_) return free_logdet(whole_);
    double sum = free_logdet(S_);
    for (const Matrix& a : A_) sum += free_logdet(a);
    return sum;
  }

  Blocks inverse() {  // the diagonal blocks Z(k,k) of T⁻¹, base to tip
    factor();
    Blocks Z(n_), right(n_), below(n_);
    if (one_) {
      const Matrix all = free_inverse(whole_);
      int at = 0;
      for (int k = 0; k < n_; at += start_[k].back(), ++k) Z[k] = all.block(at, at, start_[k].back(), start_[k].back());
      return Z;
    }
    const Matrix S = free_inverse(S_);
    for (int k = 0; k < n_; ++k) {
      const int p = parent_[k];
      const Matrix A = free_inverse(A_[k]);
      Matrix F = X_[k] * S, over = S * Y_[k] * A;
      Z[k] = A;
      if (p >= 0) {
        // N = T(p,k) A⁻¹(k), F = U(k) Z(p,b) + X(k) Z(b,b)
        const Matrix N = up_[k] * A;
        F += U_[k] * right[p];
        over += below[p] * N;
        // Z(k,k) = A⁻¹(k) + (U(k) Z(p,p) + X(k) Z(b,p)) N + F Y(k) A⁻¹(k)
        Z[k] += (U_[k] * Z[p] + X_[k] * below[p]) * N;
      }
      Z[k] += F * Y_[k] * A;
      right[k] = -F;    // Z(k,b)
      below[k] = -over;  // Z(b,k)
    }
    return Z;
  }
  Matrix block(const Blocks& Z, int k, int j, int i) const {  // block (state j, equation i) of Z(k,k)
    const auto& s = start_[k];
    return Z[k].block(s[j], s[i], s[j + 1] - s[j], s[i + 1] - s[i]);
  }

 private:
  Block view(Matrix& T, int row_body, int i, int column_body, int j) {
    const auto &r = start_[row_body], &c = start_[column_body];
    return T.block(r[i], c[j], r[i + 1] - r[i], c[j + 1] - c[j]);
  }

  // Eliminates from the leaves to the root; all at once where a pivot is singular, or nearly.
  void factor() {
    if (factored_) return;
    factored_ = true;
    A_ = U_ = X_ = Y_ = Blocks(n_);
    S_ = corner_;
    for (int k = n_ - 1; k >= 0; --k) {
      // A(k) = T(k,k) - Σ_c T(k,c) U(c), U(k) = A⁻¹(k) T(k,p)
      // X(k) = A⁻¹(k) (T(k,b) - Σ_c T(k,c) X(c)), Y(k) = T(b,k) - Σ_c Y(c) U(c)
      A_[k] = own_[k], X_[k] = right_[k], Y_[k] = below_[k];
      for (int c : children_[k]) {
        A_[k] -= up_[c] * U_[c];
        X_[k] -= up_[c] * X_[c];
        Y_[k] -= Y_[c] * U_[c];
      }
      U_[k] = free_solve(A_[k], down_[k]);
      X_[k] = free_solve(A_[k], X_[k]);
    }
    // S = T(b,b) - Σ_k Y(k) X(k)
    for (int k = 0; k < n_; ++k) S_ -= Y_[k] * X_[k];
    Blocks known = vector(1);
    double lost = 0;
    for (Matrix& s : known)
      for (int i = 0; i < s.rows(); ++i) s(i, 0) = i % 3 == 1 ? -1 : 1;
    const Blocks found = sweep(times(known));
    for (int k = 0; k <= n_; ++k)
      for (int i = 0; i < known[k].rows(); ++i) {
        const double error = std::abs(found[k](i, 0) - known[k](i, 0));
        if (!(error <= lost)) lost = error;
      }
    if (!(lost < 1e-9)) {
      one_ = true;
      whole_ = dense();
    }
  }

  Blocks sweep(const Blocks& b) const {  // T⁻¹ b by the factors
    Blocks t(n_), s = b;
    if (one_) {
      Matrix all(whole_.rows(), b[n_].cols());
      int at = 0;
      for (const Matrix& x : b) all.middleRows(at, x.rows()) = x, at += static_cast<int>(x.rows());
      all = free_solve(whole_, all);
      at = 0;
      for (Matrix& x : s) x = Matrix(all.middleRows(at, x.rows())), at += static_cast<int>(x.rows());
      return s;
    }
    for (int k = n_ - 1; k >= 0; --k) {
      // t(k) = A⁻¹(k) r(k), r(k) = b(k) - Σ_c T(k,c) t(c)
      Matrix r = b[k];
      for (int c : children_[k]) r -= up_[c] * t[c];
      t[k] = free_solve(A_[k], r);
      s[n_] -= Y_[k] * t[k];
    }
    s[n_] = free_solve(S_, s[n_]);
    for (int k = 0; k < n_; ++k) {
      // s(k) = t(k) - X(k) s(b) - U(k) s(p)
      s[k] = t[k] - X_[k] * s[n_];
      if (parent_[k] >= 0) s[k] -= U_[k] * s[parent_[k]];
    }
    return s;
  }

  Blocks times(const Blocks& s) const {  // T s
    Blocks b;
    for (int k = 0; k < n_; ++k) b.push_back(own_[k] * s[k] + right_[k] * s[n_]);
    b.push_back(corner_ * s[n_]);
    for (int k = 0; k < n_; ++k) {
      b[n_] += below_[k] * s[k];
      const int p = parent_[k];
      if (p < 0) continue;
      b[k] += down_[k] * s[p];
      b[p] += up_[k] * s[k];
    }
    return b;
  }

  Matrix dense() const {  // T as one matrix, the border last
    std::vector<int> at = {0};
    for (const auto& s : start_) at.push_back(at.back() + s.back());
    Matrix T = Matrix::Zero(at.back(), at.back());
    const auto set = [&](int i, int j, const Matrix& block) { T.block(at[i], at[j], block.rows(), block.cols()) = block; };
    for (int k = 0; k < n_; ++k) {
      set(k, k, own_[k]), set(k, n_, right_[k]), set(n_, k, below_[k]);
      if (parent_[k] >= 0) set(parent_[k], k, up_[k]), set(k, parent_[k], down_[k]);
    }
    set(n_, n_, corner_);
    return T;
  }

  std::vector<int> parent_;
  Rows children_, start_;
  int n_;
  Blocks own_, up_, down_, right_, below_, A_, U_, X_, Y_;
  Matrix corner_, S_, whole_;
  bool factored_ = false, one_ = false;
};
""",
    ),
}
