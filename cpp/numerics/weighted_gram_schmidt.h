// Columns made orthogonal one after the other, without a root: of E (n x m) with independent columns and the product ⟨a, b⟩ = Σ a_k b_k/size_k,
//
//   e_j <- e_j - Σ_{i<j} u_ij e_i,   u_ij = ⟨e_i, e_j⟩/δ_i,   δ_i = ⟨e_i, e_i⟩         ⟨E, E⟩ = U*Δ U,   u_ii = 1
//
// each product with what is left of e_j by then (modified Gram-Schmidt): U and Δ are as good as by reflections, as ⟨E, E⟩, whose rounding would
// take half of the digits, is not formed. Cost n m², but for zeros. Source: Å. Björck, Solving linear least squares problems by Gram-Schmidt
// orthogonalization, BIT 7, 1967.
#pragma once

#include <vector>

namespace pycraft {

template <class S>
class WeightedGramSchmidt {
 public:
  // E = 0, of sizes 1
  void resize(int n, int m) {
    n_ = n, m_ = m;
    E_.assign(size_t(n) * m, S(0)), sizes_.assign(n, S(1)), U_.assign(size_t(m) * m, S(0)), squares_.assign(m, S(0));
  }
  S& at(int k, int j) { return E_[size_t(j) * n_ + k]; }
  S& size(int k) { return sizes_[k]; }
  const S& square(int j) const { return squares_[j]; }  // δ

  void factor() {
    for (int j = 0; j < m_; ++j) {
      for (int i = 0; i < j; ++i) {
        const S u = product(i, j) / squares_[i];
        for (int k = 0; k < n_; ++k) at(k, j) -= u * at(k, i);
        U_[size_t(i) * m_ + j] = u;
      }
      squares_[j] = product(j, j);
    }
  }
  // ⟨E, E⟩ x = b
  void solve(const S* b, S* x) const {
    for (int j = 0; j < m_; ++j) {
      x[j] = b[j];
      for (int i = 0; i < j; ++i) x[j] -= U_[size_t(i) * m_ + j] * x[i];
    }
    for (int j = 0; j < m_; ++j) x[j] /= squares_[j];
    for (int i = m_ - 1; i >= 0; --i)
      for (int j = i + 1; j < m_; ++j) x[i] -= U_[size_t(i) * m_ + j] * x[j];
  }

 private:
  S product(int i, int j) {
    S sum = S(0);
    for (int k = 0; k < n_; ++k) sum += at(k, i) * (at(k, j) / sizes_[k]);
    return sum;
  }
  int n_ = 0, m_ = 0;
  std::vector<S> E_, sizes_, U_, squares_;
};

}  // namespace pycraft
