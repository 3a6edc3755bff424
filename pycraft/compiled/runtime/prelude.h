#include <utility>

namespace {

using pycraft::kernels::compiled::Lanes;

#if defined(__AVX512F__)
constexpr int width = 8;
#elif defined(__AVX__)
constexpr int width = 4;
#else
constexpr int width = 2;
#endif
typedef double Pack __attribute__((vector_size(width * sizeof(double))));  // as many states side by side

template <class S>
constexpr int lanes = sizeof(S) / sizeof(double);
template <class S>
using LanesOf = Lanes<double, lanes<S>>;
template <class S>
inline LanesOf<S> wide(const S& x) {
  LanesOf<S> made;
  made.v = x;
  return made;
}
template <class S>
inline S magnitude_of(const S& x) { return magnitude(wide(x)).v; }
template <class S>
inline S larger_of(const S& x, const S& y) { return larger(wide(x), wide(y)).v; }
template <class S, class F>
inline S each(S x, F f) {
  if constexpr (lanes<S> == 1) return f(x);
  else {
    for (int b = 0; b < lanes<S>; ++b) x[b] = f(x[b]);
    return x;
  }
}
template <class S>
inline S root_of(const S& x) { return each(x, [](double y) { return std::sqrt(y); }); }
template <class S>
inline S log_of(const S& x) { return each(x, [](double y) { return std::log(y); }); }
template <class S>
inline S fraction_of(const S& x) { return each(x, [](double y) { int n; return std::frexp(y, &n); }); }
template <class S>
inline S exponent_of(const S& x) { return each(x, [](double y) { int n; std::frexp(y, &n); return double(n); }); }
template <class S>
inline S sine_of(const S& x) { return sine_cosine(wide(x)).sine.v; }
template <class S>
inline S cosine_of(const S& x) { return sine_cosine(wide(x)).cosine.v; }
// As many angles as n numbers have, up to a pack, from `first` on, side by side: put together in registers, as what goes by memory waits for it.
template <int first, int n, int... b>
inline void pack_of_sines_and_cosines(const double (&angle)[n], double (&s)[n], double (&c)[n], std::integer_sequence<int, b...>) {
  constexpr auto there = [](int i) { return first + i < n ? first + i : n - 1; };
  Lanes<double, sizeof...(b)> some;
  some.v = decltype(some.v){angle[there(b)]...};
  const auto of = sine_cosine(some);
  ((s[there(b)] = of.sine.lane(b), c[there(b)] = of.cosine.lane(b)), ...);
}
// Of n angles: packs of states angle by angle; of one state, several angles at once.
template <int first = 0, int n, class S>
inline void sines_and_cosines(const S (&angle)[n], S (&s)[n], S (&c)[n]) {
  if constexpr (lanes<S> > 1) {
    for (int i = 0; i < n; ++i) {
      const auto of = sine_cosine(wide(angle[i]));
      s[i] = of.sine.v, c[i] = of.cosine.v;
    }
  } else if constexpr (first < n) {
    constexpr int left = n - first, some = left > 4 ? width : left > 2 && width > 2 ? 4 : 2;
    pack_of_sines_and_cosines<first>(angle, s, c, std::make_integer_sequence<int, some>());
    sines_and_cosines<first + some>(angle, s, c);
  }
}

// Return zero if all n values are finite, and below 2^200 with `large`; otherwise another value. The sum of x - x is taken in independent parts: one chain
// of additions would take the latency of each.
template <int n, bool large = false, class T>
inline T odd_of(const T* x) {
  if constexpr (n == 0) return T{};
  else if constexpr (n == 1) {
    const T y = large ? x[0] * 0x1p824 : x[0];
    return y - y;
  } else if constexpr (n > 32) {
    T sum = odd_of<n % 8, large>(x);
    for (int i = n % 8; i < n; i += 8) sum += odd_of<8, large>(x + i);
    return sum;
  } else return odd_of<n / 2, large>(x) + odd_of<n - n / 2, large>(x + n / 2);
}
template <int n, class T>
inline T large_of(const T* x) { return odd_of<n, true>(x); }
