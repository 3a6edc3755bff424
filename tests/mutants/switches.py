"""The header of a test build in which mutants are switches: PYCRAFT_MUTANT=number in the environment turns one on."""

HEADER = """// Written by tests/mutation.py into a copy of the tree; the sources carry nothing of it.
#pragma once
#include <cstddef>
#include <cstdlib>
#include <type_traits>
#include <utility>

namespace pycraft::mutants {

inline constexpr int count = %(count)d;
inline unsigned char touched[count + 1] = {};
inline int chosen = -1;
// Before anything else of this library: tables that are made while it is loaded see the mutant too.
__attribute__((constructor(101))) static inline void choose() {
  if (const char* number = std::getenv("PYCRAFT_MUTANT")) chosen = std::atoi(number);
}
inline bool active(int i) {
  touched[i] = 1;
  return chosen == i;
}

struct Sign {
  bool minus;
};
template <class T>
inline auto operator*(Sign s, const T& x) {
  using Value = std::decay_t<T>;
  return s.minus ? Value(-x) : Value(x);
}
// Vectors, matrices and inertias are aggregates of numbers.
template <template <class> class V, class S>
  requires std::is_aggregate_v<V<S>>
inline V<S> operator*(Sign s, const V<S>& x) {
  V<S> y = x;
  S* numbers = reinterpret_cast<S*>(&y);
  for (std::size_t i = 0; s.minus && i < sizeof(y) / sizeof(S); ++i) numbers[i] = -numbers[i];
  return y;
}

}  // namespace pycraft::mutants

extern "C" __attribute__((visibility("default"), used)) inline unsigned char* pycraft_mutants_touched() {
  return pycraft::mutants::touched;
}
extern "C" __attribute__((visibility("default"), used)) inline int pycraft_mutants_count() { return pycraft::mutants::count; }

#define PYCRAFT_MUTANT(i) (::pycraft::mutants::active(i))
#define PYCRAFT_SIGN(i) ::pycraft::mutants::Sign{::pycraft::mutants::active(i)}
#define PYCRAFT_MINUS(i) ::pycraft::mutants::Sign{!::pycraft::mutants::active(i)}
#define PYCRAFT_EITHER(i, f, g)                                 \\
  [&](auto&&... mutant_x) -> decltype(f(mutant_x...)) {         \\
    if (::pycraft::mutants::active(i)) return g(mutant_x...);   \\
    return f(mutant_x...);                                      \\
  }
#define PYCRAFT_TRANSPOSE(i)                                                                     \\
  [&](const auto& mutant_x) {                                                                    \\
    if (::pycraft::mutants::active(i)) return std::decay_t<decltype(transpose(mutant_x))>(mutant_x); \\
    return transpose(mutant_x);                                                                  \\
  }
#define PYCRAFT_TRANSPOSE_TIMES(i)                                                               \\
  [&](const auto& mutant_x, const auto& mutant_y) {                                              \\
    if (::pycraft::mutants::active(i)) return std::decay_t<decltype(transpose_times(mutant_x, mutant_y))>(mutant_x * mutant_y); \\
    return transpose_times(mutant_x, mutant_y);                                                  \\
  }
#define PYCRAFT_CROSS(i)                                                                         \\
  [&](const auto& mutant_x, const auto& mutant_y) {                                              \\
    return ::pycraft::mutants::active(i) ? cross(mutant_y, mutant_x) : cross(mutant_x, mutant_y); \\
  }
"""


def header(count):
    return HEADER % {"count": count}


def instrumented(text, mutants):
    """The text of one file with all its mutants, [(number, mutant)], as switches."""
    for number, m in sorted(mutants, key=lambda pair: pair[1].begin, reverse=True):
        assert text[m.begin : m.end] == m.before, m
        text = text[: m.begin] + m.after.replace("{i}", str(number)) + text[m.end :]
    return text
