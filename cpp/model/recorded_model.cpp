#include "model/recorded_model.h"

#include <cmath>

#include "model/compiled_model.h"
#include "numerics/recorded.h"

namespace pycraft {

template <>
std::shared_ptr<const CompiledModel<Recorded>> Multibody::compiled<Recorded>() const {
  return std::make_shared<CompiledModel<Recorded>>(broadcast<Recorded>(*compiled<double>()));
}

template <>
std::shared_ptr<const CompiledModel<Recorded>> compile_model<Recorded>(const Multibody& model, const HingeTerms& terms) {
  return std::make_shared<CompiledModel<Recorded>>(broadcast<Recorded>(*compile_model<double>(model, terms)));
}

StateData generic_state(const Multibody& model) {
  constexpr double golden = 0.6180339887498949;
  const auto number = [](int i) { return (i % 3 == 1 ? -1 : 1) * (0.4 + 0.6 * std::fmod(golden * (i + 1), 1.0)); };
  std::vector<double> q = model.zero_q(), along, v;
  for (int i = 0; i < model.nv(); ++i) along.push_back(number(i)), v.push_back(number(i + model.nv()));
  model.integrate(model.zero_q().data(), along.data(), q.data());
  return {std::move(q), std::move(v)};
}

}  // namespace pycraft
