// Rotors at hinges of several coordinates. Kinetic energy ½ v*(ℳ + J)v defines the equations of motion: those of Euler and Poincaré, in which the
// momentum J v of a subhinge's rotors is one of the subhinge's group, as its v is,
//
//   J v̇ + c(v) = T,    c(v) = -cobracket(v, J v) = v ×* (J v)       a function of the hinge's own v alone
//
// ball     ω × Jω                            zero where the three rotors are equal
// free     (ω × Jω + v × Lv; ω × Lv)         J of the three turns, L of the three travels
// one coordinate each: zero
//
// c(v) does no work, v·c(v) = 0. In c and its derivatives a sphere's part is left out, the first rotor's inertia of all turns, which no bracket
// sees: equal rotors give zero exactly.
#pragma once

#include "model/compiled_model.h"
#include "numerics/decisions.h"

namespace pycraft {

// f(kind's row, first coordinate, K) of every subhinge of body k whose rotors have a c(v), K (nv) their inertias without the sphere's part.
// J: of all coordinates; first: the body's.
template <class S, class F>
inline void each_gyrating_rotor(const CompiledModel<S>& model, int k, const S* J, F f) {
  int j = model.v_offset[k];
  for (int i = model.first_subhinge[k]; i < model.first_subhinge[k + 1]; ++i)
    with_subhinge(model.subhinges[i].kind, [&](auto row) {
      if constexpr (row.nv > 1) {
        S K[row.nv];
        bool gyrates = false;
        for (int c = 0; c < row.nv; ++c) {
          K[c] = c < 3 ? S(J[j + c] - J[j]) : J[j + c];
          gyrates = gyrates || !vanishes(K[c]);
        }
        if (gyrates) f(row, j, static_cast<const S*>(K));
      }
      j += row.nv;
    });
}

// out[j] = c(v)_j at the coordinates of body k that have one; others stay as they are.
template <class S>
inline void rotor_forces(const CompiledModel<S>& model, int k, const S* J, const S* v, S* out) {
  each_gyrating_rotor(model, k, J, [&](auto row, int j, const S* K) {
    S momentum[row.nv], force[row.nv];
    for (int c = 0; c < row.nv; ++c) momentum[c] = K[c] * v[j + c];
    row.cobracket(v + j, static_cast<const S*>(momentum), force);
    for (int c = 0; c < row.nv; ++c) out[j + c] = -force[c];
  });
}

// out[j] += ∂(μ*c)/∂v_j at the coordinates of body k:  μ*c = Kv·[μ, v], hence cobracket(μ, Kv) + K∘[μ, v].
template <class S>
inline void add_rotor_power_gradient(const CompiledModel<S>& model, int k, const S* J, const S* v, const S* mu, S* out) {
  each_gyrating_rotor(model, k, J, [&](auto row, int j, const S* K) {
    S momentum[row.nv], turned[row.nv], bracket[row.nv];
    for (int c = 0; c < row.nv; ++c) momentum[c] = K[c] * v[j + c];
    row.cobracket(mu + j, static_cast<const S*>(momentum), turned);
    row.bracket(mu + j, v + j, bracket);
    for (int c = 0; c < row.nv; ++c) out[j + c] += turned[c] + K[c] * bracket[c];
  });
}

// f(i, j, ∂c_i/∂v_j) of body k.
template <class S, class F>
inline void each_rotor_force_rate(const CompiledModel<S>& model, int k, const S* J, const S* v, F f) {
  each_gyrating_rotor(model, k, J, [&](auto row, int j, const S* K) {
    S momentum[row.nv], turned[row.nv], bracket[row.nv], unit[row.nv];
    for (int c = 0; c < row.nv; ++c) momentum[c] = K[c] * v[j + c], unit[c] = S(0);
    for (int i = 0; i < row.nv; ++i) {
      unit[i] = S(1);
      row.cobracket(static_cast<const S*>(unit), static_cast<const S*>(momentum), turned);
      row.bracket(static_cast<const S*>(unit), v + j, bracket);
      for (int c = 0; c < row.nv; ++c) f(j + i, j + c, S(turned[c] + K[c] * bracket[c]));
      unit[i] = S(0);
    }
  });
}

// f(i, j, x) of body k: what rotors add to a matrix C with C v = c(v), skew since J is constant. With S_ij = Jv·[e_i, e_j] and [v, ·] = A, it is S,
// or ½(J A - A*J + S), which is Christoffel's (Koszul's formula for J).
template <class S, class F>
inline void each_rotor_coriolis(const CompiledModel<S>& model, int k, const S* J, const S* v, bool christoffel, F f) {
  int j = model.v_offset[k];
  for (int i = model.first_subhinge[k]; i < model.first_subhinge[k + 1]; ++i)
    with_subhinge(model.subhinges[i].kind, [&](auto row) {
      if constexpr (row.nv > 1) {
        S momentum[row.nv], unit[row.nv], turned[row.nv], along[row.nv][row.nv];  // along: [v, e_b] by b
        for (int c = 0; c < row.nv; ++c) momentum[c] = J[j + c] * v[j + c], unit[c] = S(0);
        for (int b = 0; b < row.nv; ++b) {
          unit[b] = S(1);
          row.bracket(v + j, static_cast<const S*>(unit), along[b]);
          unit[b] = S(0);
        }
        for (int a = 0; a < row.nv; ++a) {
          unit[a] = S(1);
          row.cobracket(static_cast<const S*>(unit), static_cast<const S*>(momentum), turned);  // S's row a
          unit[a] = S(0);
          for (int b = 0; b < row.nv; ++b)
            f(j + a, j + b, christoffel ? S((J[j + a] * along[b][a] - along[a][b] * J[j + b] + turned[b]) / S(2)) : turned[b]);
        }
      }
      j += row.nv;
    });
}

}  // namespace pycraft
