// Sine and cosine of several numbers at once, without a branch on any of them.
//
// x = j π/2 + y, |y| <= π/4, with π/2 in three parts, the first two of 33 bits so that their products with j are exact, and y as a sum of two numbers;
// then the minimax polynomials of sine and cosine on that interval, swapped and signed by j's last two bits. In double the error is below one
// unit in the last place for |x| < 2^19 (tests/kernels), in single below 2^-23 for |x| < 2^12; larger numbers are left to the C library.
//
// Source of the coefficients in double: S. Moshier's and Sun Microsystems' published constants, as in FreeBSD's msun (k_sin.c, k_cos.c,
// e_rem_pio2.c); in single: S. Moshier, Cephes mathematical library (sinf.c).
#pragma once

#include "lanes/lanes.h"

namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET {

template <class S>
struct SineCosine {
  S sine, cosine;
};

template <class T>
struct Reduction;
template <>
struct Reduction<double> {
  static constexpr double limit = 524288, nearest = 6755399441055744.0;  // 1.5 · 2^52: adding it rounds to an integer, in the last bits
  static constexpr double first = 1.57079632673412561417e+00, second = 6.07710050630396597660e-11, third = 2.02226624879595063154e-21;
};
template <>
struct Reduction<float> {
  static constexpr float limit = 4096, nearest = 12582912.0f;  // 1.5 · 2^23
  static constexpr float first = 1.5703125f, second = 4.837512969970703125e-4f, third = 7.549789948768648e-8f;
};

// Of y + e, e far smaller than y.
template <int W>
[[gnu::always_inline]] inline SineCosine<Lanes<double, W>> of_small(const Lanes<double, W>& y, const Lanes<double, W>& e) {
  using S = Lanes<double, W>;
  const S z = y * y, cube = z * y, fourth = z * z;
  const S s = S(8.33333333332248946124e-03) + z * S(-1.98412698298579493134e-04) + fourth * (S(2.75573137070700676789e-06) + z * S(-2.50507602534068634195e-08) + fourth * S(1.58969099521155010221e-10));
  const S sine = y - ((z * (S(0.5) * e - cube * s) - e) + cube * S(1.66666666666666324348e-01));
  const S c = S(4.16666666666666019037e-02) + z * S(-1.38888888888741095749e-03) + fourth * (S(2.48015872894767294178e-05) + z * S(-2.75573143513906633035e-07) + fourth * (S(2.08757232129817482790e-09) + z * S(-1.13596475577881948265e-11)));
  const S half = S(0.5) * z, w = S(1) - half;
  return {sine, w + (((S(1) - w) - half) + (fourth * c - y * e))};
}
template <int W>
[[gnu::always_inline]] inline SineCosine<Lanes<float, W>> of_small(const Lanes<float, W>& y, const Lanes<float, W>& e) {
  using S = Lanes<float, W>;
  const S z = y * y;
  const S s = S(-1.6666654611e-1f) + z * (S(8.3321608736e-3f) + z * S(-1.9515295891e-4f));
  const S c = S(4.166664568298827e-2f) + z * (S(-1.388731625493765e-3f) + z * S(2.443315711809948e-5f));
  return {y + (y * z * s + e), (S(1) - S(0.5f) * z) + (z * z * c - y * e)};
}

template <class S>
[[gnu::always_inline]] inline SineCosine<S> sine_cosine(const S& x) {
  using T = typename S::Scalar;
  using R = Reduction<T>;
  const S nearest = x * S(T(0.63661977236758134308)) + S(R::nearest), j = nearest - S(R::nearest);
  const S a = x - j * S(R::first), w = j * S(R::second), r = a - w, back = r - a;
  const S lost = ((a - (r - back)) - (w + back)) - j * S(R::third), y = r + lost;
  const SineCosine<S> of = of_small(y, S(lost - (y - r)));
  using Bits = typename S::Bits;
  constexpr int shift = 8 * sizeof(T) - 1;
  const Bits n = nearest.bits(), odd = -(n & 1);
  const S sine = S::choose(odd, of.cosine, of.sine), cosine = S::choose(odd, of.sine, of.cosine);
  SineCosine<S> out{S::from_bits(sine.bits() ^ ((n & 2) << (shift - 1))), S::from_bits(cosine.bits() ^ (((n + 1) & 2) << (shift - 1)))};
  if (const Bits large = greater(magnitude(x), S(R::limit)); __builtin_expect(!S::everywhere(~large), 0))
    for (int b = 0; b < S::width; ++b)
      if (S::mask(large) >> b & 1) out.sine.set(b, std::sin(x.lane(b))), out.cosine.set(b, std::cos(x.lane(b)));
  return out;
}

// Of a wide number, by its own library.
template <class T>
  requires(!is_word<T>)
inline SineCosine<Lanes<T, 1>> sine_cosine(const Lanes<T, 1>& x) {
  using std::sin, std::cos;
  return {Lanes<T, 1>(sin(x.v)), Lanes<T, 1>(cos(x.v))};
}

}  // namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET
