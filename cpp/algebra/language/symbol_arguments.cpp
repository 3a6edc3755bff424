#include "algebra/language/symbol_arguments.h"

#include <functional>

#include "algebra/language/mixed_hash.h"

namespace pycraft {

namespace {

template <class... F>
struct Each : F... {
  using F::operator()...;
};

size_t mix_all(size_t h, std::initializer_list<int> numbers) {
  for (int n : numbers) h = mix(h, static_cast<size_t>(n));
  return h;
}

}  // namespace

bool fits(Takes takes, const SymbolArguments& given) {
  switch (takes) {
    case Takes::nothing: return std::holds_alternative<std::monostate>(given);
    case Takes::nodes: return std::holds_alternative<OfNodes>(given);
    case Takes::place: return std::holds_alternative<OfCoordinate>(given) || std::holds_alternative<OfTwist>(given);
    case Takes::selection: return std::holds_alternative<OfCoordinate>(given) || std::holds_alternative<OfSubhinges>(given);
    case Takes::inertia: return std::holds_alternative<OfInertia>(given);
    case Takes::direction: return std::holds_alternative<OfDirection>(given);
  }
  return false;
}

TwistPlace place_in(const SymbolArguments& given) {
  if (const auto* coordinate = std::get_if<OfCoordinate>(&given)) return *coordinate;
  return std::get<OfTwist>(given);
}

size_t hash_of(const SymbolArguments& given) {
  const size_t kind = given.index();
  return std::visit(Each{
                        [&](const std::monostate&) { return kind; },
                        [&](const OfNodes& of) {
                          size_t h = kind;
                          for (int node : of.nodes) h = mix(h, static_cast<size_t>(node));
                          return h;
                        },
                        [&](const OfCoordinate& of) { return mix_all(kind, {of.coordinate}); },
                        [&](const OfTwist& of) { return mix_all(kind, {of.body, of.position, of.component}); },
                        [&](const OfSubhinges& of) { return mix_all(kind, {of.body, of.from, of.to}); },
                        [&](const OfInertia& of) {
                          size_t h = mix_all(kind, {of.body});
                          for (InertiaParameter p : of.parameters) h = mix(h, static_cast<size_t>(p));
                          return h;
                        },
                        [&](const OfDirection& of) {
                          size_t h = mix_all(kind, {of.time});
                          for (const auto& [amount, place] : of.twists) h = mix(mix(h, std::hash<double>()(amount)), hash_of(as_arguments(place)));
                          return h;
                        },
                    },
                    given);
}

}  // namespace pycraft
