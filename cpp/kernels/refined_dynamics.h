// Forward dynamics refined, with the factors of the elimination kept: numerics/refinement.h where nothing is refused. What it would refuse, or
// what leaves the range of numbers, comes back in doubt.
#pragma once

#include <cfloat>

#include "kernels/factored_dynamics.h"
#include "kernels/residual_rounding_of_links.h"

namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET {

// u of forces: of a double, or of masses that were rounded to 64 bits at least.
template <class S, class V>
inline constexpr double force_unit = std::is_same_v<S, V> ? DBL_EPSILON / 2 : DBL_EPSILON / 4096;

// at.steps corrections at most of what is eliminated, forces gathered in V. Solutions and corrections are compared by their largest entries, and
// with what rounding may have made of a correction by its length: with d = δ/|δ|_max, along d/|d|.
template <class S, class V, class T>
[[gnu::noinline, gnu::flatten]] unsigned refine_eliminated(const Links<T>& links, const States<T>& at, const RefinedWork<S, V>& w, typename S::Bits sound, double* out, size_t stride) {
  using Bits = typename S::Bits;
  Bits open = S::all();
  outward(links, 0, links.count, Vector3<S>(-spread<S>(at.gravity)), w.response, [&](int k, Vector3<S>& alpha, Vector3<S>& acceleration) {
    const auto& link = links.link[k];
    ForwardMultiple<S>* const multiple = w.forward.of(link);
    with_step(link.step, [&](auto kind) {
      accelerate_link<decltype(kind), true>(link, w.forward.link[k], w.forward.link[k].innovation, multiple->rate, multiple, alpha, acceleration,
                                            [&](int i, const S& x, const S* absorbed) { w.x[link.v + i] = x, w.absorbed[link.v + i] = absorbed ? *absorbed : S(0); });
    });
  });
  S last(0);
  for (int step = 0; step < at.steps; ++step) {
    correction(links, at, w);
    S largest(0), solution(0), sum(0);
    for (int i = 0; i < links.nv; ++i) {
      const S size = magnitude(w.delta[i]);
      largest = larger(largest, size), solution = larger(solution, magnitude(w.x[i])), sum += size;
    }
    sound = sound & greater(S(DBL_MAX), sum);
    open = open & greater(largest, S(S(4 * DBL_EPSILON) * solution)) & sound;
    sound = sound & ~(open & greater(largest, S(S(0.3) * solution)));
    open = open & sound;
    if (S::mask(open) == 0) break;
    const S scale = S(1) / largest;
    S square(0);  // |d|²
    for (int i = 0; i < links.nv; ++i) {
      const S d = scale * w.delta[i];
      square += d * d;
    }
    const S rounding = rounding_along_correction(links, at, w, scale, DBL_EPSILON / 2, force_unit<S, V>);
    sound = sound & (~open | greater(S(DBL_MAX), rounding));
    // Links of one coordinate each add up more than hinges of several: what is to be left out though it counts, the general recursions judge where
    // so much more may decide.
    const Bits beyond = greater(largest * square, rounding);
    if (links.several) sound = sound & (~open | beyond | ~greater(largest, S(S(64 * DBL_EPSILON) * solution)) | greater(rounding, S(S(6) * largest * square)));
    open = open & beyond & sound;
    const S now = largest * square * largest;  // |δ|²
    if (step > 0) open = open & greater(last, S(S(4) * now));
    for (int i = 0; i < links.nv; ++i) w.x[i] += S::choose(open, w.delta[i], S(0));
    last = now;
    open = open & greater(largest, S(S(DBL_EPSILON) * solution));
    if (S::mask(open) == 0) break;
  }
  for (int i = 0; i < links.nv; ++i) scattered(S(w.x[i] - w.absorbed[i]), out + i, stride, at.states);
  return S::mask(sound);
}

// In the form fast.
template <class S, class V>
unsigned refined_dynamics(const Links<typename S::Scalar>& links, const States<typename S::Scalar>& at, double* out, size_t stride, typename S::Scalar* work) {
  const RefinedWork<S, V> w(links, work);
  return refine_eliminated(links, at, w, move_and_eliminate(links, at, w.forward), out, stride);
}
// In a factored form.
template <class S, class V, bool roots>
unsigned refined_dynamics_by_factors(const Links<typename S::Scalar>& links, const States<typename S::Scalar>& at, double* out, size_t stride, typename S::Scalar* work) {
  const RefinedWork<S, V> w(links, work);
  const FactoredWork<S> factored(links, w.forward, work + RefinedWork<S, V>::size(links) / sizeof(typename S::Scalar));
  return refine_eliminated(links, at, w, move_and_eliminate<roots>(links, at, factored), out, stride);
}

}  // namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET
