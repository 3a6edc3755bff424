// Programs (program.h) done at blocks of states: an instruction is a loop over the vectors of its places, a run of equal ones is called once.
#pragma once

#include <cmath>
#include <utility>

#include "lanes/lane_sets.h"
#include "lanes/sine_cosine.h"

namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET {

// R vectors of S::width states a place.
template <class S, int R>
struct Replaying {
  using V = typename S::Vector;
  using Bits = typename S::Bits;
  using Words = const std::uint32_t*;
  static constexpr int W = S::width;

  struct Frame {
    char* base;
    const double* constants;
    const BlockOfStates& block;
    Bits sound[R];
    V odd[R];  // zero where all is finite
  };
  [[gnu::always_inline]] static V* place(const Frame& f, std::uint32_t at) { return reinterpret_cast<V*>(f.base + size_t(at) * R); }

  // ---------------------------------------------------------------- arithmetic
  template <bool is_constant>
  struct Operand {  // the same in all states, or a place
    V of_all;
    const V* at;
    [[gnu::always_inline]] Operand(const Frame& f, std::uint32_t word) {
      if constexpr (is_constant)
        of_all = S(f.constants[word]).v;
      else
        at = place(f, word);
    }
    [[gnu::always_inline]] V operator[](int r) const {
      if constexpr (is_constant) return of_all;
      return at[r];
    }
  };
  template <bool fuses, unsigned kind, class A, class B>
  [[gnu::always_inline]] static V with_term(V total, const A& a, const B& b, int r) {
    if constexpr (fuses)
      return kind & subtracted ? fused(-a[r], b[r], total) : fused(a[r], b[r], total);
    else
      return kind & subtracted ? total - a[r] * b[r] : total + a[r] * b[r];
  }
  template <bool fuses, First first, int terms, unsigned kinds>
  static Words sum(Words at, std::uint32_t count, Frame& f) {
    constexpr bool product = first == First::product || first == First::multiple;
    constexpr int begin = product ? 3 : 2, words = begin + 2 * terms;
    do {
      V* const to = place(f, at[0]);
      const Operand<(first == First::multiple || first == First::constant)> a(f, at[1]);
      const Operand<(!product && first == First::constant)> b(f, at[product ? 2 : 1]);
      const Operand<(kinds & of_constant) != 0> x0(f, at[terms > 0 ? begin : 1]);
      const Operand<false> y0(f, at[terms > 0 ? begin + 1 : 0]);
      const Operand<(kinds >> 2 & of_constant) != 0> x1(f, at[terms > 1 ? begin + 2 : 1]);
      const Operand<false> y1(f, at[terms > 1 ? begin + 3 : 0]);
      each_of<R>([&](int r) __attribute__((always_inline)) {
        V total = a[r];
        if constexpr (product) total = a[r] * b[r];
        if constexpr (terms > 0) total = with_term<fuses, kinds & 3>(total, x0, y0, r);
        if constexpr (terms > 1) total = with_term<fuses, (kinds >> 2)>(total, x1, y1, r);
        to[r] = total;
      });
      at += words;
    } while (--count);
    return at;
  }
  // to = f(a), f(a, b), f(a, b, c)
  template <int operands, class F>
  [[gnu::always_inline]] static Words each(Words at, std::uint32_t count, const Frame& f, F&& operate) {
    do {
      V* const to = place(f, at[0]);
      const V* from[operands];
      for (int i = 0; i < operands; ++i) from[i] = place(f, at[1 + i]);
      for (int r = 0; r < R; ++r) {
        if constexpr (operands == 1)
          to[r] = operate(S::of(from[0][r])).v;
        else if constexpr (operands == 2)
          to[r] = operate(S::of(from[0][r]), S::of(from[1][r])).v;
        else
          to[r] = operate(S::of(from[0][r]), S::of(from[1][r]), S::of(from[2][r])).v;
      }
      at += 1 + operands;
    } while (--count);
    return at;
  }
  static Words add(Words at, std::uint32_t count, Frame& f) { return each<2>(at, count, f, [](S a, S b) { return a + b; }); }
  static Words subtract(Words at, std::uint32_t count, Frame& f) { return each<2>(at, count, f, [](S a, S b) { return a - b; }); }
  static Words divide(Words at, std::uint32_t count, Frame& f) { return each<2>(at, count, f, [](S a, S b) { return a / b; }); }
  static Words negate(Words at, std::uint32_t count, Frame& f) { return each<1>(at, count, f, [](S a) { return -a; }); }
  static Words magnitudes(Words at, std::uint32_t count, Frame& f) { return each<1>(at, count, f, [](S a) { return magnitude(a); }); }
  static Words larger_of(Words at, std::uint32_t count, Frame& f) { return each<2>(at, count, f, [](S a, S b) { return larger(a, b); }); }

  // ---------------------------------------------------------------- functions
  static Words sines(Words at, std::uint32_t count, Frame& f) {
    for (; count; --count, at += 3) {
      V *const sine = place(f, at[0]), *const cosine = place(f, at[1]);
      const V* const x = place(f, at[2]);
      for (int r = 0; r < R; ++r) {
        const SineCosine<S> of = sine_cosine(S::of(x[r]));
        sine[r] = of.sine.v, cosine[r] = of.cosine.v;
      }
    }
    return at;
  }
  template <class F>
  [[gnu::always_inline]] static Words each_number(Words at, std::uint32_t count, const Frame& f, F&& function) {
    return each<1>(at, count, f, [&](S a) {
      for (int b = 0; b < W; ++b) a.set(b, function(a.lane(b)));
      return a;
    });
  }
  static Words root(Words at, std::uint32_t count, Frame& f) {
    return each_number(at, count, f, [](double x) { return std::sqrt(x); });
  }
  static Words logarithm(Words at, std::uint32_t count, Frame& f) {
    return each_number(at, count, f, [](double x) { return std::log(x); });
  }
  static Words fraction(Words at, std::uint32_t count, Frame& f) {
    return each_number(at, count, f, [](double x) {
      int n;
      return std::frexp(x, &n);
    });
  }
  static Words exponent(Words at, std::uint32_t count, Frame& f) {
    return each_number(at, count, f, [](double x) {
      int n = 0;
      static_cast<void>(std::frexp(x, &n));
      return double(n);
    });
  }

  // ---------------------------------------------------------------- truths and guards
  static Bits is_greater(const V& a, const V& b) { return a > b; }
  static Bits is_at_least(const V& a, const V& b) { return a >= b; }
  static Bits is_equal(const V& a, const V& b) { return a == b; }
  template <Bits (*is)(const V&, const V&)>
  static Words truth(Words at, std::uint32_t count, Frame& f) {
    return each<2>(at, count, f, [](S a, S b) { return S::from_bits(is(a.v, b.v)); });
  }
  static Words both(Words at, std::uint32_t count, Frame& f) {
    return each<2>(at, count, f, [](S a, S b) { return S::from_bits(a.bits() & b.bits()); });
  }
  static Words choose(Words at, std::uint32_t count, Frame& f) {
    return each<3>(at, count, f, [](S truth, S a, S b) { return S::choose(truth.bits(), a, b); });
  }
  template <Bits (*is)(const V&, const V&), bool holds>
  static Words guard(Words at, std::uint32_t count, Frame& f) {
    for (; count; --count, at += 2) {
      const V *const a = place(f, at[0]), *const b = place(f, at[1]);
      for (int r = 0; r < R; ++r) f.sound[r] &= holds ? is(a[r], b[r]) : ~is(a[r], b[r]);
    }
    return at;
  }
  static Words finite(Words at, std::uint32_t count, Frame& f) {
    for (; count; --count, ++at) {
      const V* const x = place(f, *at);
      for (int r = 0; r < R; ++r) f.odd[r] += x[r] - x[r];
    }
    return at;
  }

  // ---------------------------------------------------------------- inputs and results
  static Words input(Words at, std::uint32_t count, Frame& f) {
    const BlockOfStates& block = f.block;
    for (; count; --count, at += 3) {
      auto* const to = reinterpret_cast<double*>(place(f, at[0]));
      const Entries& from = block.inputs[at[1]];
      const double* const numbers = from.numbers + block.first * from.stride + at[2];
      for (int b = 0; b < R * W; ++b) to[b] = numbers[size_t(b < block.states ? b : block.states - 1) * from.stride];
    }
    return at;
  }
  static Words result(Words at, std::uint32_t count, Frame& f) {
    const BlockOfStates& block = f.block;
    double* const out = block.out + block.first * block.stride;
    for (; count; --count, at += 2) {
      const V* const x = place(f, at[1]);
      for (int r = 0; r < R; ++r) f.odd[r] += x[r] - x[r];
      const auto* const numbers = reinterpret_cast<const double*>(x);
      for (int b = 0; b < block.states; ++b) out[b * block.stride + at[0]] = numbers[b];
    }
    return at;
  }

  // ---------------------------------------------------------------- by code
  using Instruction = Words (*)(Words, std::uint32_t, Frame&);
  template <int code>
  static constexpr Instruction of_sum() {
    constexpr int terms = code >> 4 & 3;
    constexpr unsigned kinds = code & 15;
    constexpr First first = static_cast<First>(code >> 6 & 3);
    constexpr bool product = first == First::product || first == First::multiple;
    if constexpr (terms > most_terms || kinds >> 2 * terms != 0 || (terms == 0 && (code & 256 || !product)))
      return nullptr;
    else
      return sum<(code & 256) != 0, first, terms, kinds>;
  }
  struct Table {  // plain data: functions of the standard library would be shared with sources for other machines
    Instruction by_code[static_cast<int>(Code::count)];
  };
  template <int... codes>
  static constexpr Table table(std::integer_sequence<int, codes...>) {
    return {{
        of_sum<codes>()..., add, subtract, divide, negate, sines, root, logarithm, fraction, exponent, magnitudes, larger_of,
        truth<is_greater>, truth<is_at_least>, truth<is_equal>, both, choose,
        guard<is_greater, true>, guard<is_at_least, true>, guard<is_equal, true>, guard<is_greater, false>, guard<is_at_least, false>, guard<is_equal, false>,
        finite, input, result}};
  }
  static constexpr Table instructions = table(std::make_integer_sequence<int, static_cast<int>(Code::add)>());

  static void prepare(const ProgramText& program, double* memory) {
    for (size_t i = 0; i < program.placed; ++i)
      for (int b = 0; b < R * W; ++b) *memory++ = program.constants[i];
  }
  static void run(const ProgramText& program, const BlockOfStates& block, double* memory) {
    Frame f{reinterpret_cast<char*>(memory), program.constants, block, {}, {}};
    for (int r = 0; r < R; ++r) f.sound[r] = S::all(), f.odd[r] = V{};
    double* const out = block.out + block.first * block.stride;
    for (int b = 0; b < block.states; ++b) {
      if (program.blank) __builtin_memcpy(out + b * block.stride, program.blank, block.stride * sizeof(double));
      for (size_t i = 0; i < program.fixed_count; ++i) out[b * block.stride + program.fixed[i]] = program.fixed_values[i];
    }
    for (Words at = program.code; at != program.end;) {
      const std::uint32_t head = *at++;
      at = instructions.by_code[head & ((1u << code_bits) - 1)](at, head >> code_bits, f);
    }
    for (int b = 0; b < block.states; ++b) block.sound[b] = (f.sound[b / W][b % W] & 1) && f.odd[b / W][b % W] == 0;
  }
  static constexpr Replay replay{R, prepare, run};
};

template <int W>
void turn_sines(double angle, double* out) {
  Lanes<double, W> x(angle / 2);
  x.set(0, angle);
  const auto of = sine_cosine(x);
  out[0] = of.cosine.lane(0), out[1] = of.sine.lane(0), out[2] = of.sine.lane(1);
}

constexpr bool fuses_products =
#if defined(__FMA__) || defined(__aarch64__)
    true;
#else
    false;
#endif

// W states a vector; one, several or many vectors a place.
template <int W, int several, int many>
constexpr LaneFunctions lane_functions{W, {Replaying<Lanes<double, W>, 1>::replay, Replaying<Lanes<double, W>, several>::replay, Replaying<Lanes<double, W>, many>::replay}, fuses_products, turn_sines<neighbours<double>>,
                                         2, Replaying<Lanes<double, 2>, 1>::replay};

}  // namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET
