// `taken` states from state b on; how many of them are in doubt: where a guard fails, or an input or a result is not finite.
template <class S>
inline std::int64_t run(const double* const* given, const std::int64_t* strides, double* out, std::int64_t b, int taken) {
  S input[@INPUTS@], y[@OUTPUTS@], odd = S{};
  for (int i = 0, first = 0; i < @ARRAYS@; first += widths[i++])
    for (int j = 0; j < widths[i]; ++j) {
      const double* const from = given[i] + b * strides[i] + j;
      S& to = input[first + j];
      if constexpr (lanes<S> == 1) to = *from;
      else for (int l = 0; l < lanes<S>; ++l) to[l] = from[(l < taken ? l : taken - 1) * strides[i]];
      odd += to - to;
    }
  const auto held = evaluate<S>(@PLACES@);
  for (int i = 0; i < @OUTPUTS@; ++i) odd += y[i] - y[i];
  const auto sound = held & (odd == S{});
  std::int64_t doubted = 0;
  double* const to = out + b * @OUTPUTS@;
  if constexpr (lanes<S> == 1) {
    for (int i = 0; i < @OUTPUTS@; ++i) to[i] = y[i];
    doubted = !sound;
  } else {
    for (int l = 0; l < taken; ++l) {
      for (int i = 0; i < @OUTPUTS@; ++i) to[l * @OUTPUTS@ + i] = y[i][l];
      doubted += !sound[l];
    }
  }
  return doubted;
}

}  // namespace

// Input i of state b lies at given[i] + b strides[i], its @OUTPUTS@ results at out + @OUTPUTS@ b. How many states are in doubt.
extern "C" std::int64_t @FUNCTION@(const double* const* given, const std::int64_t* strides, double* out, std::int64_t states) {
  if (states == 1) return run<double>(given, strides, out, 0, 1);
  std::int64_t doubted = 0;
  for (std::int64_t b = 0; b < states; b += width) doubted += run<Pack>(given, strides, out, b, static_cast<int>(states - b < width ? states - b : width));
  return doubted;
}
