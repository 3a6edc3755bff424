// Numbers of several states side by side, one instruction for all. A comparison gives a truth per lane.
//
// Everything of the kernels lives in a namespace named for the instruction set that a source is built for: functions of one set never take
// the place of another's when objects are linked, as all of their arguments have types of that namespace.
//
// A product that is added to or taken from another number is fused with that where the instruction set can: it is not rounded by itself.
// Which ones are is said by how a formula is written, left to right, and not left to the compiler: one state has the digits that it has in a
// pack. In a b ± c d the second product is rounded.
#pragma once

#ifndef PYCRAFT_INSTRUCTION_SET
#error "kernels are built by cpp/kernels/kernels_*.cpp alone"
#endif

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#if defined(__FMA__)
#include <immintrin.h>
#elif defined(__aarch64__)
#include <arm_neon.h>
#endif

namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET {

// Truths of numbers that are no machine word have no bits in common with these.
template <class T>
struct BitsOf {
  using type = std::int64_t;
};
template <>
struct BitsOf<float> {
  using type = std::int32_t;
};

// a b + c, of numbers or of vectors of them.
#if defined(__FMA__) || defined(__aarch64__)
[[gnu::always_inline]] inline double fused(double a, double b, double c) { return __builtin_fma(a, b, c); }
[[gnu::always_inline]] inline float fused(float a, float b, float c) { return __builtin_fmaf(a, b, c); }
// Of numbers wider than words nothing fuses them.
template <class T>
  requires(std::is_class_v<T> || std::is_same_v<T, long double>)
[[gnu::always_inline]] inline T fused(const T& a, const T& b, const T& c) { return a * b + c; }
#endif
#if defined(__FMA__)
[[gnu::always_inline]] inline __m128d fused(__m128d a, __m128d b, __m128d c) { return _mm_fmadd_pd(a, b, c); }
[[gnu::always_inline]] inline __m256d fused(__m256d a, __m256d b, __m256d c) { return _mm256_fmadd_pd(a, b, c); }
[[gnu::always_inline]] inline __m256 fused(__m256 a, __m256 b, __m256 c) { return _mm256_fmadd_ps(a, b, c); }
#ifdef __AVX512F__
[[gnu::always_inline]] inline __m512d fused(__m512d a, __m512d b, __m512d c) { return _mm512_fmadd_pd(a, b, c); }
[[gnu::always_inline]] inline __m512 fused(__m512 a, __m512 b, __m512 c) { return _mm512_fmadd_ps(a, b, c); }
#endif
#elif defined(__aarch64__)
[[gnu::always_inline]] inline float64x2_t fused(float64x2_t a, float64x2_t b, float64x2_t c) { return vfmaq_f64(c, a, b); }
[[gnu::always_inline]] inline float32x4_t fused(float32x4_t a, float32x4_t b, float32x4_t c) { return vfmaq_f32(c, a, b); }
template <class V>
  requires(!std::is_class_v<V> && sizeof(V) > 16)  // than a register
[[gnu::always_inline]] inline V fused(const V& a, const V& b, const V& c) {
  V x;
  for (std::size_t i = 0; i < sizeof(V) / sizeof(x[0]); ++i) x[i] = fused(a[i], b[i], c[i]);
  return x;
}
#else
template <class V>
[[gnu::always_inline]] inline V fused(const V& a, const V& b, const V& c) { return a * b + c; }
#endif

// Whether instructions take several of them.
template <class T>
inline constexpr bool is_word = std::is_same_v<T, double> || std::is_same_v<T, float>;
// Numbers of one state that one instruction takes.
template <class T>
inline constexpr int neighbours = !is_word<T> ? 1 :
#ifdef __AVX__
    32 / sizeof(T);
#else
    16 / sizeof(T);
#endif

// A product on its way.
template <class S>
struct Product {
  S a, b;
  [[gnu::always_inline]] operator S() const { return S::of(a.v * b.v); }
  [[gnu::always_inline]] friend S operator+(const Product& x, const S& c) { return S::of(fused(x.a.v, x.b.v, c.v)); }
  [[gnu::always_inline]] friend S operator+(const S& c, const Product& x) { return S::of(fused(x.a.v, x.b.v, c.v)); }
  [[gnu::always_inline]] friend S operator+(const Product& x, const Product& y) { return x + S(y); }
  [[gnu::always_inline]] friend S operator-(const Product& x, const S& c) { return S::of(fused(x.a.v, x.b.v, -c.v)); }
  [[gnu::always_inline]] friend S operator-(const S& c, const Product& x) { return S::of(fused(-x.a.v, x.b.v, c.v)); }
  [[gnu::always_inline]] friend S operator-(const Product& x, const Product& y) { return x - S(y); }
  [[gnu::always_inline]] friend Product operator-(const Product& x) { return {-x.a, x.b}; }
};

template <class T, int W>
struct Lanes {
  using Scalar = T;
  using Bit = typename BitsOf<T>::type;
  typedef T Vector __attribute__((vector_size(W * sizeof(T))));
  typedef Bit Bits __attribute__((vector_size(W * sizeof(T))));
  static constexpr int width = W;
  static constexpr bool recorded = false;  // its truths are known where they are made
  Vector v;

  Lanes() = default;
  [[gnu::always_inline]] Lanes(T x) : v(x - Vector{}) {}
  [[gnu::always_inline]] static Lanes of(Vector x) {
    Lanes a;
    a.v = x;
    return a;
  }
  T lane(int b) const { return v[b]; }
  void set(int b, T x) { v[b] = x; }

  [[gnu::always_inline]] Lanes& operator+=(const Lanes& b) { v += b.v; return *this; }
  [[gnu::always_inline]] Lanes& operator-=(const Lanes& b) { v -= b.v; return *this; }
  [[gnu::always_inline]] Lanes& operator+=(const Product<Lanes>& b) { return *this = *this + b; }
  [[gnu::always_inline]] Lanes& operator-=(const Product<Lanes>& b) { return *this = *this - b; }
  [[gnu::always_inline]] Lanes& operator*=(const Lanes& b) { v *= b.v; return *this; }
  [[gnu::always_inline]] friend Lanes operator+(const Lanes& a, const Lanes& b) { return of(a.v + b.v); }
  [[gnu::always_inline]] friend Lanes operator-(const Lanes& a, const Lanes& b) { return of(a.v - b.v); }
  [[gnu::always_inline]] friend Product<Lanes> operator*(const Lanes& a, const Lanes& b) { return {a, b}; }
  [[gnu::always_inline]] friend Lanes operator/(const Lanes& a, const Lanes& b) { return of(a.v / b.v); }
  [[gnu::always_inline]] friend Lanes operator-(const Lanes& a) { return of(-a.v); }

  // ---- truths: all bits of a lane, or none
  [[gnu::always_inline]] static Bits all() { return ~Bits{}; }
  [[gnu::always_inline]] friend Bits greater(const Lanes& a, const Lanes& b) { return a.v > b.v; }
  [[gnu::always_inline]] friend Bits same(const Lanes& a, const Lanes& b) { return a.v == b.v; }
  [[gnu::always_inline]] static Lanes choose(Bits truth, const Lanes& a, const Lanes& b) { return of((Vector)((truth & (Bits)a.v) | (~truth & (Bits)b.v))); }
  static unsigned mask(Bits truth) {
    unsigned m = 0;
    for (int b = 0; b < W; ++b) m |= unsigned(truth[b] & 1) << b;
    return m;
  }
  // Whether it holds in every lane.
  [[gnu::always_inline]] static bool everywhere(Bits truth) {
#if defined(__AVX512DQ__) && defined(__AVX512VL__)
    if constexpr (sizeof truth == 64 && sizeof(T) == 8) return _mm512_movepi64_mask((__m512i)truth) == 0xff;
    if constexpr (sizeof truth == 64 && sizeof(T) == 4) return _mm512_movepi32_mask((__m512i)truth) == 0xffff;
#endif
#ifdef __AVX__
    if constexpr (sizeof truth == 32) return _mm256_movemask_epi8((__m256i)truth) == -1;
#endif
    return mask(truth) == mask(all());
  }
  [[gnu::always_inline]] Bits bits() const { return (Bits)v; }
  [[gnu::always_inline]] static Lanes from_bits(Bits x) { return of((Vector)x); }
};

// One state.
template <class T>
struct Lanes<T, 1> {
  using Scalar = T;
  using Bit = typename BitsOf<T>::type;
  using Bits = Bit;
  static constexpr int width = 1;
  static constexpr bool recorded = false;
  T v;

  Lanes() = default;
  [[gnu::always_inline]] Lanes(T x) : v(x) {}
  [[gnu::always_inline]] static Lanes of(T x) { return x; }
  T lane(int) const { return v; }
  void set(int, T x) { v = x; }

  [[gnu::always_inline]] Lanes& operator+=(const Lanes& b) { v += b.v; return *this; }
  [[gnu::always_inline]] Lanes& operator-=(const Lanes& b) { v -= b.v; return *this; }
  [[gnu::always_inline]] Lanes& operator+=(const Product<Lanes>& b) { return *this = *this + b; }
  [[gnu::always_inline]] Lanes& operator-=(const Product<Lanes>& b) { return *this = *this - b; }
  [[gnu::always_inline]] Lanes& operator*=(const Lanes& b) { v *= b.v; return *this; }
  [[gnu::always_inline]] friend Lanes operator+(const Lanes& a, const Lanes& b) { return Lanes(a.v + b.v); }
  [[gnu::always_inline]] friend Lanes operator-(const Lanes& a, const Lanes& b) { return Lanes(a.v - b.v); }
  [[gnu::always_inline]] friend Product<Lanes> operator*(const Lanes& a, const Lanes& b) { return {a, b}; }
  [[gnu::always_inline]] friend Lanes operator/(const Lanes& a, const Lanes& b) { return Lanes(a.v / b.v); }
  [[gnu::always_inline]] friend Lanes operator-(const Lanes& a) { return Lanes(-a.v); }

  [[gnu::always_inline]] static Bits all() { return ~Bits{}; }
  [[gnu::always_inline]] friend Bits greater(const Lanes& a, const Lanes& b) { return -Bits(a.v > b.v); }
  [[gnu::always_inline]] friend Bits same(const Lanes& a, const Lanes& b) { return -Bits(a.v == b.v); }
  [[gnu::always_inline]] static Lanes choose(Bits truth, const Lanes& a, const Lanes& b) {
    if constexpr (is_word<T>)
      return from_bits((truth & a.bits()) | (~truth & b.bits()));
    else
      return truth ? a : b;
  }
  static unsigned mask(Bits truth) { return unsigned(truth & 1); }
  [[gnu::always_inline]] static bool everywhere(Bits truth) { return truth != 0; }
  [[gnu::always_inline]] Bits bits() const {
    Bits x;
    __builtin_memcpy(&x, &v, sizeof x);
    return x;
  }
  [[gnu::always_inline]] static Lanes from_bits(Bits x) {
    Lanes a;
    __builtin_memcpy(&a.v, &x, sizeof x);
    return a;
  }
};

template <class T, int W>
[[gnu::always_inline]] inline Lanes<T, W> magnitude(const Lanes<T, W>& a) {
  if constexpr (is_word<T>) {
    constexpr auto sign = typename BitsOf<T>::type(1) << (8 * sizeof(T) - 1);
    return Lanes<T, W>::from_bits(a.bits() & ~sign);
  } else {
    return a.v < T(0) ? -a : a;
  }
}
template <class T, int W>
[[gnu::always_inline]] inline Lanes<T, W> larger(const Lanes<T, W>& a, const Lanes<T, W>& b) {
  if constexpr (W == 1)
    return b.v > a.v ? b : a;
  else
    return Lanes<T, W>::choose(greater(b, a), b, a);
}
// f(0), ..., f(n - 1), written out: a compiler makes vectors of a loop's neighbours, which costs more than it brings for three.
template <int n, class F>
[[gnu::always_inline]] inline void each_of(F f) {
  if constexpr (n > 0) each_of<n - 1>(f), f(n - 1);
}
// One number of every state, as the lanes are or rounded to them all at once.
template <class S>
[[gnu::always_inline]] inline S gathered(const double* x, std::size_t stride, int states) {
  using T = typename S::Scalar;
  if constexpr (S::width == 1) {
    return S(T(*x));
  } else {
    if (states == 1) return S(T(*x));
    Lanes<double, S::width> a;
    if (states == S::width) {
      for (int b = 0; b < S::width; ++b) a.set(b, x[b * stride]);
    } else {
      for (int b = 0; b < S::width; ++b) a.set(b, x[(b < states ? b : states - 1) * stride]);
    }
    if constexpr (std::is_same_v<T, double>)
      return a;
    else
      return S::of(__builtin_convertvector(a.v, typename S::Vector));
  }
}
template <class S>
[[gnu::always_inline]] inline void scattered(const S& a, double* x, std::size_t stride, int states) {
  if constexpr (S::width == 1) {
    *x = double(a.v);
  } else {
    Lanes<double, S::width> all;
    if constexpr (std::is_same_v<typename S::Scalar, double>)
      all = a;
    else
      all.v = __builtin_convertvector(a.v, typename Lanes<double, S::width>::Vector);
    if (states == S::width)
      for (int b = 0; b < S::width; ++b) x[b * stride] = all.lane(b);
    else
      for (int b = 0; b < states; ++b) x[b * stride] = all.lane(b);
  }
}

// Neighbours in memory, wherever that begins.
template <class S>
struct Loose {
  typedef typename S::Scalar type __attribute__((vector_size(sizeof(S)), aligned(sizeof(typename S::Scalar)), may_alias));
};
template <class T>
struct Loose<Lanes<T, 1>> {
  using type = T;
};
template <class S>
[[gnu::always_inline]] inline S from_memory(const typename S::Scalar* x) {
  S a;
  a.v = *reinterpret_cast<const typename Loose<S>::type*>(x);
  return a;
}
template <class S>
[[gnu::always_inline]] inline void to_memory(const S& a, typename S::Scalar* x) {
  *reinterpret_cast<typename Loose<S>::type*>(x) = a.v;
}

// Numbers of one state that stand side by side are taken several at a time; packs of states, and numbers that are written down, one by one.
template <class S>
struct BlockOf {
  using type = S;
  static constexpr int columns = 1;
};
template <class T>
struct BlockOf<Lanes<T, 1>> {
  using type = Lanes<T, neighbours<T>>;
  static constexpr int columns = neighbours<T>;
};
template <class S>
using Block = typename BlockOf<S>::type;

// As V, one or a block.
template <class V, class S>
[[gnu::always_inline]] inline V loaded(const S* x) {
  if constexpr (std::is_same_v<V, S>)
    return *x;
  else
    return from_memory<V>(reinterpret_cast<const typename V::Scalar*>(x));
}
template <class V, class S>
[[gnu::always_inline]] inline void stored(const V& value, S* x) {
  if constexpr (std::is_same_v<V, S>)
    *x = value;
  else
    to_memory(value, reinterpret_cast<typename V::Scalar*>(x));
}
template <class V, class S>
[[gnu::always_inline]] inline V wide(const S& x) {
  if constexpr (std::is_same_v<V, S>)
    return x;
  else
    return V(x.lane(0));
}
// Of columns c, c + 1, ...: 1 at column i and 0 beside it.
template <class V, class S>
[[gnu::always_inline]] inline V unit(int c, int i) {
  V value(typename V::Scalar(0));
  if constexpr (std::is_same_v<V, S>) {
    if (c == i) value = V(typename V::Scalar(1));
  } else if (c <= i && i < c + V::width) {
    value.set(i - c, 1);
  }
  return value;
}

// A result that has left already.
template <class S>
[[gnu::always_inline]] inline void raise(double& x, typename S::Scalar by) {
  x += double(by);
}

}  // namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET
