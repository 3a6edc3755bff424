// Compute one state from and to the caller's own arrays; a copy through other arrays would wait for their stores. Return 1 if the state is in doubt:
// a guard fails, an input is too large, or a result is not finite.
template <int... i>
inline std::int64_t run_one(const double* const* given, double* y, std::integer_sequence<int, i...>) {
  const bool held = evaluate<double>(given[i]..., y);
  return !(held & ((large_of<widths[i]>(given[i]) + ... + odd_of<@OUTPUTS@>(y)) == 0));
}

// `taken` states from state b on; how many of them are in doubt.
template <int... i>
inline std::int64_t run(const double* const* given, const std::int64_t* strides, double* out, std::int64_t b, int taken, std::integer_sequence<int, i...>) {
  Pack y[@OUTPUTS@], input[@INPUTS@];
  const Pack* from[@ARRAYS@ + 1];
  for (int k = 0, first = 0; k < @ARRAYS@; first += widths[k++]) {
    const double* const array = given[k] + b * strides[k];
    from[k] = input + first;
    for (int j = 0; j < widths[k]; ++j)
      for (int l = 0; l < width; ++l) input[first + j][l] = array[(l < taken ? l : taken - 1) * strides[k] + j];
  }
  const auto held = evaluate<Pack>(from[i]..., y);
  const auto sound = held & ((large_of<widths[i]>(from[i]) + ... + odd_of<@OUTPUTS@>(y)) == Pack{});
  std::int64_t doubted = 0;
  double* const to = out + b * @OUTPUTS@;
  for (int l = 0; l < taken; ++l) {
    for (int j = 0; j < @OUTPUTS@; ++j) to[l * @OUTPUTS@ + j] = y[j][l];
    doubted += !sound[l];
  }
  return doubted;
}

}  // namespace

// Input i of state b lies at given[i] + b strides[i], its @OUTPUTS@ results at out + @OUTPUTS@ b. How many states are in doubt.
extern "C" std::int64_t @FUNCTION@(const double* const* given, const std::int64_t* strides, double* out, std::int64_t states) {
  constexpr std::make_integer_sequence<int, @ARRAYS@> all;
  if (states == 1) return run_one(given, out, all);
  std::int64_t doubted = 0;
  for (std::int64_t b = 0; b < states; b += width) doubted += run(given, strides, out, b, static_cast<int>(states - b < width ? states - b : width), all);
  return doubted;
}
