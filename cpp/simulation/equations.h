// What integrators integrate: ẋ = f(x, t) on x = (q, v, rest), q on the group of a model's configurations, and what else a motion has between
// its steps. How accelerations are found is a type, and so is what an integrator takes (integrators/pairing.h):
//
//   Equations               what all have: rates at a state, stops, events, names
//   ExplicitEquations       v̇ at states, and nothing else
//   ImplicitEquations       v̇ of a step of size h, with h C + h² K in D
//   LinearizedEquations     v̇ and its derivatives
//   VariationalEquations    momenta, and the forces that change them
//
// simulation/scene_equations.h has those of a scene.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <string>
#include <vector>

#include "model/configuration.h"
#include "simulation/integrators/stages.h"

namespace pycraft {

template <class S>
class Equations {
 public:
  using State = std::vector<S>;
  Equations(const CompiledModel<S>& model, int rest) : model_(model), rest_(rest) {}
  virtual ~Equations() = default;

  const CompiledModel<S>& model() const { return model_; }
  int nq() const { return model_.nq; }
  int nv() const { return model_.nv; }
  int rest() const { return rest_; }  // numbers of x after q and v
  int size() const { return nq() + nv() + rest_; }
  // Of these the last are integrals beside the motion, on which no rate depends.
  virtual int integrals() const { return 0; }

  void operator()(const State& x, State& rate, const S& t) {
    const S *q = x.data(), *v = q + nq();
    S* const to = rate.data();
    evaluate(t, q, v, v + nv(), to + nq(), to + nq() + nv());
    configuration_rate(model_, at_q_, at_v_, to);
  }
  // v̇ and the rates of what follows it, by parts: for methods that move q on its group.
  virtual void evaluate(const S& t, const S* q, const S* v, const S* rest, S* vdot, S* rest_rate) = 0;
  // The rates of all stages of a step.
  virtual void go_through(Stages<S>& stages) {
    while (stages.next()) (*this)(stages.at(), stages.rate(), stages.time());
  }
  // The velocities at which that was done.
  const S* velocities() const { return at_v_; }

  // After a step to t: what is known by other means than the step.
  virtual void settle(const S&, State&) {}
  // Whether that changes what later rates depend on.
  virtual bool settles() const { return false; }
  // Where a step must end after t, infinite: nowhere; what happens to x there, and whether velocities are others then.
  virtual bool stops() const { return false; }
  virtual double next_stop(double) const { return std::numeric_limits<double>::infinity(); }
  virtual void stop(const S&, State&) {}
  virtual bool jumps() const { return false; }
  // Times known beforehand at which functions of time go over from one expression to another: a step ends there. The first after t.
  virtual double next_knot(double) const { return std::numeric_limits<double>::infinity(); }
  // Until the next such call rates are asked for from `from` to `to`: where one of these is a knot, functions of time have there the values that
  // they have inside.
  virtual void between(const S&, const S&) {}
  // Velocities that jump at a knot t, from what they are in x to what follows: numbers of those that do, among these.
  virtual std::vector<std::string> jump_names() const { return {}; }
  virtual std::vector<int> jump(const S&, State&) { return {}; }
  // Functions of t and x at whose zeros the equations are others, by whose they are: a step ends there. And their rates.
  virtual std::vector<std::string> event_names() const { return {}; }
  virtual void events(const S&, const State&, S*) {}
  virtual void event_rates(const S&, const State&, S*) {}
  // What number i of x is, for errors.
  virtual std::string name_of(int i) const { return "number " + std::to_string(i) + " of the state"; }

  long evaluations = 0;

 protected:
  const S *at_q_ = nullptr, *at_v_ = nullptr;  // set by evaluate

 private:
  const CompiledModel<S>& model_;
  int rest_;
};

template <class S>
class ExplicitEquations : public Equations<S> {
 public:
  using Equations<S>::Equations;
};

template <class S>
class ImplicitEquations : public Equations<S> {
 public:
  using Equations<S>::Equations;
  // v̇ = (v⁺ - v)/h of a step of size h, and the mean rates in it of what follows.
  virtual void evaluate_step(const S& t, const S& h, const S* q, const S* v, const S* rest, S* vdot, S* rest_rate) = 0;
};

// With z = (v, y), y what the motion depends on besides, u a displacement along quasi-velocities: A ż = g, A = (ℳ + J, 1), and ∂g at ż held.
struct Linearization {
  Eigen::MatrixXd mass, along_u, along_z;  // A, ∂g/∂u (n x nv), ∂g/∂z (n x n)
  Eigen::VectorXd along_t;                 // ∂ż/∂t
  std::vector<char> known;                 // per coordinate: by other means than the step, so that no error counts
};

template <class S>
class LinearizedEquations : public Equations<S> {
 public:
  using Equations<S>::Equations;
  // At a state whose rates are these. h: of the step to come, for differences in time.
  virtual void linearize(const S& t, const S& h, const S* q, const S* v, const S* rest, const S* vdot, const S* rest_rate, Linearization& out) = 0;
  long linearizations = 0;
};

template <class S>
class VariationalEquations : public Equations<S> {
 public:
  using Equations<S>::Equations;
  // π = (ℳ + J) v.
  virtual void momentum(const S* q, const S* v, S* pi) = 0;
  // That, ∂KE/∂θ + T of all forces, and the rates of what follows v in x but for the integrals.
  virtual void momentum_and_forces(const S& t, const S* q, const S* v, const S* rest, S* pi, S* forces, S* rest_rate) = 0;
  // (ℳ + J) x = r.
  virtual void solve(const S* q, const S* r, S* x) = 0;
  long solutions = 0;
};

}  // namespace pycraft
