// `taken` states from state b on; how many of them are in doubt: where a guard fails, or an input or a result is not finite.
template <class S>
inline std::int64_t run(const double* const* given, const std::int64_t* strides, double* out, std::int64_t b, int taken) {
  S y[@OUTPUTS@], odd = S{};
  const S* from[@ARRAYS@ + 1];
  [[maybe_unused]] S input[lanes<S> == 1 ? 1 : @INPUTS@];
  for (int i = 0, first = 0; i < @ARRAYS@; first += widths[i++]) {
    const double* const array = given[i] + b * strides[i];
    if constexpr (lanes<S> == 1) from[i] = array;
    else {
      from[i] = input + first;
      for (int j = 0; j < widths[i]; ++j)
        for (int l = 0; l < lanes<S>; ++l) input[first + j][l] = array[(l < taken ? l : taken - 1) * strides[i] + j];
    }
    for (int j = 0; j < widths[i]; ++j) odd += from[i][j] - from[i][j];
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
