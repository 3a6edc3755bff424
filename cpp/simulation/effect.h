// What an effect is: something that acts on a model when a scene has it, and is not there when no scene has.
//
// An effect is made for a model: names are resolved then, parameters are checked. Before any state is seen it declares what it needs and what it
// gives, by structure, and a scene is compiled from these declarations alone (simulation/compiled_scene.h). At a state it does no more than its
// own arithmetic, in the scalar of the scene, by one virtual call: `BoundEffect<S>`, one for every scalar in which scenes run and for numbers
// with derivatives, first ones and second ones.
//
// A new effect is a class that derives from Effect, a class template that derives from BoundEffect, and a line PYCRAFT_BIND_EFFECT that says
// which belongs to which (simulation/effects/ has examples, docs/scenes.md follows one).
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "model/hinge_terms.h"
#include "model/loops.h"
#include "model/multibody.h"
#include "numerics/scalar.h"
#include "numerics/tangent.h"
#include "simulation/function_of_time.h"
#include "spatial/pose.h"

namespace pycraft {

using WithDerivatives = Tangent<double, 4>;
using WithCurvature = Tangent<WithDerivatives, 4>;
#define PYCRAFT_FOR_EACH_SCENE_SCALAR(X) X(double) X(Extended) X(Quad)
#define PYCRAFT_FOR_EACH_EFFECT_SCALAR(X) PYCRAFT_FOR_EACH_SCENE_SCALAR(X) X(WithDerivatives) X(WithCurvature)

// A term on the diagonal of D at a coordinate: J always, and h C + h² K in a step of size h that is taken implicitly.
struct HingeTerm {
  int coordinate;
  double inertia = 0, damping = 0, stiffness = 0;
};

// Loops of a model that a scene keeps, all where no name is given, with Baumgarte's α and β (1/s), or embedded.
struct KeptLoops {
  std::shared_ptr<const LoopSet> set;
  std::vector<std::string> names;
  double alpha = 0, beta = 0;
  bool embedded = false;
  std::vector<std::string> kept() const { return names.empty() ? set->names() : names; }
};

struct Declaration {
  // ---- needs
  bool time = false;                 // whether it is another one at another time
  std::vector<Knot> knots;           // where it goes over from one function of time to another; rates that jump there are of velocities that it prescribes
  bool velocities = false;           // whether it depends on them
  bool only_in_motion = false;       // nothing is given at rest: a statics query passes it over
  std::vector<int> poses, twists;    // of these bodies
  // ---- gives
  std::vector<int> coordinates;      // generalized forces on these
  std::vector<int> wrenches;         // forces on these bodies
  Vector3<double> gravity{0, 0, 0};  // a uniform field, m/s²: no forces of its own, but a number for the accelerations
  bool uniform_gravity = false;
  std::vector<HingeTerm> hinges;
  std::vector<int> prescribed;       // coordinates, all of a subhinge or none
  std::shared_ptr<const KeptLoops> loops;  // rows that accelerations keep to
  bool of_trees = false;             // what it gives is of all coordinates of a tree: not beside loops
  // ---- energy
  bool potential = false;            // whether it has one
  bool work = false;                 // whether some of its forces have none
  // ---- states of its own
  std::vector<double> states;        // what they are at first: rates() says how they change
  std::vector<double> held;          // after these, kept from one sample to the next
  double period = 0;                 // s between samples; 0: none
  // ---- impulses, between steps: (ℳ + J + C) Δv = p, p what impulses() gives, C the damping of what resists
  double impulse_period = 0;         // s from one to the next, the first after half of it; 0: none
  std::vector<HingeTerm> resists;
  int events = 0;                    // functions of the state at whose zeros it is another one
  bool foreign = false;              // calls from outside of the core: what it gives is looked at each time
  bool differentiable = true;        // whether its forces and rates can be taken on numbers with derivatives
  int own() const { return static_cast<int>(states.size() + held.size()); }
};

// A state as an effect sees it. Poses and twists are there of the bodies that it asked for.
template <class S>
struct At {
  S t;
  const S *q, *v;              // v is all zeros at rest
  const Pose<S>* pose;         // X_WB by body
  const Vector6<S>* twist;     // (ω; v) by body, in its axes
  const S* own;                // its states, then what it holds
  S step;                      // h, where accelerations are those of an implicit step; 0: plain ones

  // Of a node, -1 the base.
  Pose<S> pose_of(int body, const Pose<S>& node) const { return body < 0 ? node : pose[body] * node; }
};

// Where forces are added to: by coordinate, and (n; f) by body in its axes about its origin.
template <class S>
struct Forces {
  S* generalized;
  Vector6<S>* wrench;
};

// Why an effect has no second derivatives at a state, and the coordinate where: -1, of all of it.
struct Edge {
  const char* why;
  int coordinate = -1;
};

template <class S>
class BoundEffect {
 public:
  virtual ~BoundEffect() = default;
  // Told once, before any state: what all effects of the scene do at hinges.
  virtual void begin(const HingeTerms&) {}
  virtual void forces(const At<S>&, const Forces<S>&) {}
  virtual S potential(const At<S>&) { return S(0); }
  // The power of what has no potential, of all its forces' `whole`.
  virtual S power(const At<S>&, const S& whole) { return whole; }
  virtual void rates(const At<S>&, S*) {}
  virtual void sample(const At<S>&, S*) {}  // to what it holds
  virtual void impulses(const At<S>&, std::uint64_t, S*) {}  // number so and so, added to generalized impulses (nv)
  virtual void events(const At<S>&, S*) {}
  virtual void event_rates(const At<S>&, S*) {}  // of those functions, along the motion
  virtual std::optional<Edge> edge(const At<S>&) { return {}; }
  // Positions, velocities and accelerations of its prescribed coordinates, to their places among all; what is null is not asked for. Whether they
  // are finite, and quaternions have a direction.
  virtual bool prescribe(const S&, S*, S*, S*) { return true; }
};

class Effect {
 public:
  virtual ~Effect() = default;
  virtual std::string kind() const = 0;  // as errors and default names have it: "coulomb_friction"
  virtual Declaration declaration() const = 0;
  virtual std::unique_ptr<BoundEffect<double>> bind(double) const = 0;
  virtual std::unique_ptr<BoundEffect<Extended>> bind(Extended) const = 0;
  virtual std::unique_ptr<BoundEffect<Quad>> bind(Quad) const = 0;
  virtual std::unique_ptr<BoundEffect<WithDerivatives>> bind(WithDerivatives) const = 0;
  virtual std::unique_ptr<BoundEffect<WithCurvature>> bind(WithCurvature) const = 0;
};

// Declares, in a class, that it binds to every scalar.
#define PYCRAFT_BINDS                                                                      \
  std::unique_ptr<BoundEffect<double>> bind(double) const override;                        \
  std::unique_ptr<BoundEffect<Extended>> bind(Extended) const override;                    \
  std::unique_ptr<BoundEffect<Quad>> bind(Quad) const override;                            \
  std::unique_ptr<BoundEffect<WithDerivatives>> bind(WithDerivatives) const override;      \
  std::unique_ptr<BoundEffect<WithCurvature>> bind(WithCurvature) const override;
// Says that Bound<S>(const Class&) is what Class binds to.
#define PYCRAFT_BIND_EFFECT(Class, Bound)                                                                                                    \
  std::unique_ptr<BoundEffect<double>> Class::bind(double) const { return std::make_unique<Bound<double>>(*this); }                          \
  std::unique_ptr<BoundEffect<Extended>> Class::bind(Extended) const { return std::make_unique<Bound<Extended>>(*this); }                    \
  std::unique_ptr<BoundEffect<Quad>> Class::bind(Quad) const { return std::make_unique<Bound<Quad>>(*this); }                                \
  std::unique_ptr<BoundEffect<WithDerivatives>> Class::bind(WithDerivatives) const { return std::make_unique<Bound<WithDerivatives>>(*this); } \
  std::unique_ptr<BoundEffect<WithCurvature>> Class::bind(WithCurvature) const { return std::make_unique<Bound<WithCurvature>>(*this); }

}  // namespace pycraft
