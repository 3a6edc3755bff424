#include "simulation/integrators/pairing.h"

#include <algorithm>

#include "runtime/errors.h"
#include "simulation/integrators/rosenbrock.h"
#include "simulation/integrators/runge_kutta_steps.h"
#include "simulation/integrators/steps_on_the_group.h"
#include "simulation/integrators/switching_steps.h"
#include "simulation/integrators/variational.h"
#include "simulation/scene_linearized.h"
#include "simulation/scene_momenta.h"
#include "simulation/scene_steps.h"

namespace pycraft {

namespace {

// No other pair compiles.
static_assert(PairsWith<SceneSteps<double>, SemiImplicitEuler<double>> && PairsWith<SceneMomenta<double>, Variational2<double>> && PairsWith<SceneEquations<double>, MuntheKaas4<double>>);
static_assert(!PairsWith<SceneSteps<double>, MuntheKaas4<double>> && !PairsWith<SceneEquations<double>, SemiImplicitEuler<double>> && !PairsWith<SceneEquations<double>, Variational2<double>>);

bool is_implicit(const Declaration& d) {
  return std::any_of(d.hinges.begin(), d.hinges.end(), [](const HingeTerm& h) { return h.damping != 0 || h.stiffness != 0; });
}

// The first effect that is on and fits, null: none.
template <class F>
const SceneEntry* effect_with(const Scene& scene, F fits) {
  for (const SceneEntry& e : scene.entries())
    if (e.on && fits(e.effect->declaration())) return &e;
  return nullptr;
}

void refuse_implicit_effects(const Scene& scene, const std::string& integrator) {
  if (const SceneEntry* e = effect_with(scene, is_implicit))
    throw EvaluationError(integrator + " finds accelerations at states, and effect '" + e->name + "' acts in steps, as h C + h² K in D: take integrator 'semi-implicit-euler' or 'rosenbrock4', or an effect " +
                          "that acts at states (Damping, Spring)");
}

void refuse_loops(const Scene& scene, const std::string& integrator, const std::string& why) {
  if (const SceneEntry* e = effect_with(scene, [](const Declaration& d) { return d.loops != nullptr; }))
    throw EvaluationError(integrator + " " + why + ", and effect '" + e->name + "' keeps loops, by accelerations at states that are taken back onto them after each step: take integrator 'dopri5', 'dop853' or 'rkmk4'");
}

std::string quoted(const std::string& name) { return "integrator '" + name + "'"; }

// What "auto" comes to: rosenbrock4 alone where effects act in steps, dopri5 alone where there are no derivatives to solve with.
Integrator chosen(const Scene& scene, Precision precision, Integrator integrator) {
  if (integrator != Integrator::automatic) return integrator;
  if (precision != Precision::double_ || effect_with(scene, [](const Declaration& d) { return d.loops != nullptr; })) return Integrator::dopri5;
  return effect_with(scene, is_implicit) ? Integrator::rosenbrock4 : integrator;
}

template <class Method, class S, PairsWith<Method> Way>
Paired<S> pair_fixed(std::unique_ptr<Way> way, const IntegratorOptions& options) {
  auto stepper = std::make_unique<FixedSteps<S, Method>>(*way, options);
  return {std::move(way), std::move(stepper)};
}

}  // namespace

void check_pairing(const Scene& scene, Precision precision, Integrator integrator) {
  const IntegratorRecord& record = record_of(chosen(scene, precision, integrator));
  const std::string name = quoted(record.name);
  if (record.way == Way::with_derivatives && precision != Precision::double_)
    throw EvaluationError(name + " solves by derivatives of accelerations, which are in double precision, and the scene computes in '" + precision_name(precision) +
                          "': take precision='double', or integrator 'dop853'");
  if (record.way == Way::by_momenta || record.way == Way::with_derivatives) refuse_loops(scene, name, record.way == Way::by_momenta ? "steps by momenta" : "solves by derivatives of the tree's accelerations");
  if (record.way == Way::at_states || record.way == Way::by_momenta) refuse_implicit_effects(scene, name);
  if (record.way != Way::by_momenta) return;
  if (const SceneEntry* e = effect_with(scene, [](const Declaration& d) { return !d.prescribed.empty(); }))
    throw EvaluationError(name + " steps by the momenta of all coordinates, and effect '" + e->name + "' prescribes '" + scene.model().structure().coordinate_names[e->effect->declaration().prescribed[0]] +
                          "': take another integrator ('rkmk4', 'dopri5'), or disable the effect");
}

void check_foreign_pairing(const Scene& scene, Precision precision, const std::string& name, bool implicit) {
  if (precision != Precision::double_)
    throw EvaluationError(quoted(name) + " keeps states in double precision, and the scene computes in '" + precision_name(precision) + "': take precision='double', or integrator 'dop853'");
  refuse_loops(scene, quoted(name), "takes its steps outside of the core");
  if (!implicit) refuse_implicit_effects(scene, quoted(name));
}

template <class S>
Paired<S> paired(CompiledScene<S>& scene, bool works, const IntegratorOptions& options) {
  constexpr Precision precision = std::is_same_v<S, double> ? Precision::double_ : std::is_same_v<S, Extended> ? Precision::extended : Precision::quad;
  check_pairing(scene.scene(), precision, options.integrator);
  const Integrator integrator = chosen(scene.scene(), precision, options.integrator);
  switch (integrator) {
    case Integrator::semi_implicit_euler: return pair_fixed<SemiImplicitEuler<S>, S>(std::make_unique<SceneSteps<S>>(scene, works), options);
    case Integrator::variational2: return pair_fixed<Variational2<S>, S>(std::make_unique<SceneMomenta<S>>(scene, works), options);
    case Integrator::variational4: return pair_fixed<Variational4<S>, S>(std::make_unique<SceneMomenta<S>>(scene, works), options);
    case Integrator::automatic:
    case Integrator::rosenbrock4:
      if constexpr (std::is_same_v<S, double>) {
        auto way = std::make_unique<SceneLinearized>(scene, works);
        std::unique_ptr<Stepper<double>> stepper;
        if (integrator == Integrator::rosenbrock4)
          stepper = rosenbrock_steps(*way, options);
        else
          stepper = switching_steps(*way, dormand_prince_steps(*way, options), rosenbrock_steps(*way, options));
        return {std::move(way), std::move(stepper)};
      }
      [[fallthrough]];
    default: {
      auto way = std::make_unique<SceneEquations<S>>(scene, works);
      auto stepper = runge_kutta_steps<S>(*way, options);
      return {std::move(way), std::move(stepper)};
    }
  }
}

template PYCRAFT_PAIRED(double)
template PYCRAFT_PAIRED(Extended)
template PYCRAFT_PAIRED(Quad)

}  // namespace pycraft
