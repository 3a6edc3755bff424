// What direct calls on arrays share: arguments with an optional leading batch axis, outputs, and the run over states and scalars.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "bindings/bindings.h"
#include "dynamics/workspace_pool.h"
#include "runtime/errors.h"

namespace pycraft {

// Direct calls of one kind on one model, at every scalar: Workspace<S> does the work, one per thread.
template <template <class> class Workspace>
class DirectCalls {
 public:
  explicit DirectCalls(std::shared_ptr<Multibody> model) : model_(std::move(model)) {}
  const Multibody& model() const { return *model_; }

  // Calls f(workspace, b) for the states from, ..., to - 1 of a batch.
  template <class S, class F>
  void each(int from, int to, int states, F f) {
    std::get<Pool<S>>(pools_).with(*model_, [&](Workspace<S>& w) {
      for (int b = from; b < to; ++b) {
        naming_state(b, states, [&] { f(w, b); });
        if (b % 16 == 15) check_interrupt();
      }
    });
  }

 private:
  template <class S>
  using Pool = WorkspacePool<Workspace<S>>;
  std::shared_ptr<Multibody> model_;
  PerScalar<Pool> pools_;
};

// One array argument: its data, its stride between states (0 where it is shared by all).
struct Argument {
  Array array;
  py::ssize_t stride = 0;
  int batch = -1;
};

inline Argument argument(const py::object& given, int width, const char* what, const Multibody& model) {
  Argument a;
  a.array = numbers(what[1] == 0 ? part_of_state(given, what) : given, what);
  if (a.array.ndim() < 1 || a.array.ndim() > 2 || a.array.shape(a.array.ndim() - 1) != width)
    throw ModelError(std::string(what) + " of '" + model.name() + "' takes " + std::to_string(width) + " numbers, or (B, " + std::to_string(width) + ") for a batch");
  if (a.array.ndim() == 2) {
    a.batch = static_cast<int>(a.array.shape(0));
    a.stride = width;
  }
  return a;
}

// An argument in the memory that the result is written to would change while it is read: it is copied first.
inline void keep_apart(Argument& a, const py::array_t<double>& out) {
  const double *from = a.array.data(), *to = out.data();
  if (!a.array || from >= to + out.size() || to >= from + a.array.size()) return;
  a.array = Array(std::vector<py::ssize_t>(a.array.shape(), a.array.shape() + a.array.ndim()), from);
}

inline int common_batch(std::initializer_list<const Argument*> arguments) {
  int batch = -1;
  for (const Argument* a : arguments) {
    if (a->batch < 0) continue;
    if (batch >= 0 && batch != a->batch)
      throw ModelError("batches of " + std::to_string(batch) + " and " + std::to_string(a->batch) + " states in one call");
    batch = a->batch;
  }
  return batch;
}

inline py::array_t<double> output(const py::object& out, int batch, std::vector<py::ssize_t> shape) {
  if (batch >= 0) shape.insert(shape.begin(), batch);
  if (out.is_none()) return py::array_t<double>(shape);
  constexpr int aligned = py::detail::npy_api::NPY_ARRAY_ALIGNED_;
  const bool fits = py::isinstance<py::array_t<double>>(out) && (py::cast<py::array>(out).flags() & aligned) && (py::cast<py::array>(out).flags() & py::array::c_style) && py::cast<py::array>(out).writeable() &&
                    py::cast<py::array>(out).ndim() == static_cast<py::ssize_t>(shape.size()) &&
                    std::equal(shape.begin(), shape.end(), py::cast<py::array>(out).shape());
  if (!fits) {
    std::string text;
    for (py::ssize_t n : shape) text += (text.empty() ? "" : ", ") + std::to_string(n);
    throw ModelError("out= takes a writeable C-ordered float64 array of shape (" + text + ")");
  }
  return py::cast<py::array_t<double>>(out);
}

inline void check_states(const Multibody& m, const Argument& q, int batch) {
  for (int b = 0; b < (q.stride ? batch : 1); ++b) m.check_q(q.array.data() + b * q.stride, m.nq());
}
inline void check_velocities(const Multibody& m, const Argument& v, int batch, const char* what) {
  for (int b = 0; b < (v.stride ? batch : 1); ++b) m.check_v(v.array.data() + b * v.stride, m.nv(), what);
}

inline bool all_finite(const double* x, size_t n) {
  return std::all_of(x, x + n, [](double y) { return std::isfinite(y); });
}
// What left the range of its numbers is no result.
inline void require_finite(const double* x, size_t n, const Multibody& model) {
  if (!all_finite(x, n))
    throw EvaluationError("a result for '" + model.name() +
                          "' is beyond the range of its numbers: the state, the forces or the masses are too large or too small; take other units, or a wider precision");
}

// Calls that stop at quad.
inline constexpr const char* to_quad = "this call computes in precision 'single' to 'quad'; operators, and forward dynamics, go to 100 digits";
template <template <class> class Workspace, class S>
inline constexpr bool available_at = true;

// Runs f(workspace, inputs..., out) state after state at the precision asked for.
template <template <class> class Workspace, class F>
py::array_t<double> run(DirectCalls<Workspace>& d, Precision precision, std::vector<std::pair<const Argument*, int>> in, py::array_t<double> out, int out_size, int batch, F f) {
  const int states = batch < 0 ? 1 : batch;
  double* target = out.mutable_data();
  std::vector<Argument> own;
  own.reserve(in.size());
  for (const auto& [a, _] : in) keep_apart(own.emplace_back(*a), out);
  std::vector<const double*> data;
  for (const Argument& a : own) data.push_back(a.array.data());
  const ModelInUse use(d.model());  // before the GIL goes: what was checked holds
  ReleasedGil release;
  const auto run_in = [&]<class S>(S) {
    std::vector<std::vector<S>> wide(in.size());
    std::vector<const S*> at(in.size());
    std::vector<S> result(out_size);
    d.template each<S>(0, states, states, [&](Workspace<S>& w, int b) {
      for (size_t i = 0; i < in.size(); ++i) {
        const double* from = data[i] + b * in[i].first->stride;
        if constexpr (std::is_same_v<S, double>) {
          at[i] = from;
        } else {
          wide[i].assign(from, from + in[i].second);
          at[i] = wide[i].data();
        }
      }
      if constexpr (std::is_same_v<S, double>) {
        f(w, at.data(), target + size_t(b) * out_size);
      } else {
        f(w, at.data(), result.data());
        for (int i = 0; i < out_size; ++i) target[size_t(b) * out_size + i] = to_double(result[i]);
      }
      require_finite(target + size_t(b) * out_size, out_size, d.model());
    });
  };
  const auto widest = [&]<class S>(S s) {
    if constexpr (available_at<Workspace, S>)
      run_in(s);
    else
      throw EvaluationError(to_quad);
  };
  at_precision(precision, widest);
  return out;
}

}  // namespace pycraft
