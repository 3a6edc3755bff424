// The direct calls that go from CPython to the core (register_direct_calls.cpp): what each takes, its result, and who computes it.
#pragma once

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "dynamics/batch_dynamics.h"
#include "runtime/errors.h"

namespace pycraft::direct {

struct Options {
  Solving how;
  Precision precision = Precision::double_;
  bool skew = false;  // of a Coriolis matrix
};

// A call as it came, as far as it is plain.
struct Asked {
  BatchDynamics* dynamics = nullptr;
  Options options;
  Node node;                   // of what is asked of a frame
  std::array<Given, 3> given;
  int states = -1;             // one
  PyObject* out = nullptr;     // a new array
};

// What a call takes besides arrays.
enum Takes : unsigned { takes_frame = 1, takes_solving = 2, takes_precision = 4, takes_method = 8, takes_coriolis = 16 };

// The axes of the result of one state: how many, and how long.
struct Axes {
  int count;
  std::array<int, 2> lengths;
};
inline constexpr int coordinates = -1;  // the length nv of the model

struct DirectCall {
  const char* name;
  std::array<const char*, 3> arrays;  // null after the last
  unsigned takes;
  Axes result;
  bool (*compute)(const Asked& a, double* out);  // false: the Python function decides
  std::optional<kernels::Call> derivatives;  // of calls with three results, where kernels are sure of all states

  int given() const { return static_cast<int>(std::find(arrays.begin(), arrays.end(), nullptr) - arrays.begin()); }
  // Those of a prepared call. The method is none of them: what stands here is the articulated one.
  std::vector<const char*> options() const {
    std::vector<const char*> names;
    if (takes & takes_frame) names = {"frame"};
    if (takes & takes_solving) names.insert(names.end(), {"form", "refine", "residual"});
    if (takes & takes_solving && !derivatives) names.push_back("on_singular");
    if (takes & takes_coriolis) names.push_back("form");
    if (takes & takes_precision) names.push_back("precision");
    return names;
  }
};

inline constexpr DirectCall direct_calls[] = {
    {"forward_dynamics", {"q", "v", "tau"}, takes_solving | takes_precision | takes_method, {1, {coordinates}}, [](const Asked& a, double* out) {
       a.dynamics->forward_dynamics(a.given[0], a.given[1], a.given[2], a.options.how, a.options.precision, out);
       return true;
     }},
    {"inverse_dynamics", {"q", "v", "vdot"}, takes_precision, {1, {coordinates}}, [](const Asked& a, double* out) {
       a.dynamics->inverse_dynamics(a.given[0], a.given[1], &a.given[2], a.options.precision, out);
       return true;
     }},
    {"bias_forces", {"q", "v"}, takes_precision, {1, {coordinates}}, [](const Asked& a, double* out) {
       a.dynamics->inverse_dynamics(a.given[0], a.given[1], nullptr, a.options.precision, out);
       return true;
     }},
    {"mass_matrix", {"q"}, takes_precision, {2, {coordinates, coordinates}}, [](const Asked& a, double* out) {
       a.dynamics->mass_matrix(a.given[0], a.options.precision, out);
       return true;
     }},
    {"mass_matrix_inverse", {"q"}, takes_solving | takes_precision, {2, {coordinates, coordinates}}, [](const Asked& a, double* out) {
       a.dynamics->mass_matrix_inverse(a.given[0], a.options.how, a.options.precision, out);
       return true;
     }},
    {"jacobian", {"q"}, takes_frame | takes_precision, {2, {6, coordinates}}, [](const Asked& a, double* out) {
       a.dynamics->jacobian(a.node, a.given[0], a.options.precision, out);
       return true;
     }},
    {"pose", {"q"}, takes_frame, {2, {4, 4}}, [](const Asked& a, double* out) {
       a.dynamics->pose(a.node, a.given[0], out);
       return true;
     }},
    {"coriolis_matrix", {"q", "v"}, takes_coriolis | takes_precision, {2, {coordinates, coordinates}}, [](const Asked& a, double* out) {
       return a.options.precision == Precision::double_ && a.dynamics->coriolis_matrix(a.options.skew, a.given[0], a.given[1], out);
     }},
    {"operational_space_inertia", {"q"}, takes_frame | takes_precision, {2, {6, 6}}, [](const Asked& a, double* out) {
       return a.options.precision == Precision::double_ && a.dynamics->operational_space(true, {&a.node, 1}, a.given[0], out);
     }},
    {"operational_space_compliance", {"q"}, takes_frame | takes_precision, {2, {6, 6}}, [](const Asked& a, double* out) {
       return a.options.precision == Precision::double_ && a.dynamics->operational_space(false, {&a.node, 1}, a.given[0], out);
     }},
    {"inverse_dynamics_derivatives", {"q", "v", "vdot"}, takes_precision, {2, {coordinates, coordinates}}, nullptr, kernels::Call::inverse_dynamics_derivatives},
    {"forward_dynamics_derivatives", {"q", "v", "tau"}, takes_solving | takes_precision, {2, {coordinates, coordinates}}, nullptr, kernels::Call::forward_dynamics_derivatives},
};

inline const DirectCall& direct_call(const std::string& name) {
  std::string known;
  for (const DirectCall& call : direct_calls) {
    if (name == call.name) return call;
    known += (known.empty() ? "'" : ", '") + std::string(call.name) + "'";
  }
  throw EvaluationError("'" + name + "' is no direct call; there are " + known);
}

}  // namespace pycraft::direct
