// What a run gives out, row after row in double precision, and where it can go on from. It is Python's: an error or an interrupt leaves what was
// computed in it.
#pragma once

#include <exception>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bindings/bindings.h"
#include "simulation/compiled_scene.h"
#include "simulation/integrators/integrate.h"
#include "simulation/stiffness.h"

namespace pycraft {

struct Rows {
  std::vector<double> t, q, v, own, work;
};

// A checkpoint's numbers as exact sums of doubles.
struct WrittenCheckpoint {
  std::vector<double> t, size, origin;
  std::vector<std::vector<double>> x;
  long taken = 0;
  std::vector<int> signs;
  std::vector<std::vector<double>> lengths;
};

struct RunRecord {
  bool keeps_steps = true;
  Rows steps, samples;
  Rows events;                 // works none
  std::vector<int> event_of;   // their numbers
  std::vector<std::string> own_events;  // by the effects that they are of; those that were asked for follow
  int nq = 0, nv = 0, own = 0, works = 0, ended_by = -1;
  IntegrationCost cost;
  long linearizations = 0, solutions = 0, in_packs = 0;
  double seconds = 0;
  std::optional<Stiffness> stiffness;              // where stability holds the steps of an explicit method, or those of one size are unstable
  std::vector<std::pair<double, int>> switches;    // RunEnd's
  std::vector<PassRecord> passes;
  WrittenCheckpoint checkpoint;
  std::exception_ptr error;  // of one run among several: what ended it
};

template <class S>
WrittenCheckpoint written(const Checkpoint<S>& c) {
  WrittenCheckpoint w{expansion(c.t), expansion(c.pace.size), expansion(c.pace.origin), {}, c.pace.taken, c.signs, {}};
  for (const S& x : c.x) w.x.push_back(expansion(x));
  for (const S& length : c.lengths) w.lengths.push_back(expansion(length));
  return w;
}
template <class S>
Checkpoint<S> read(const WrittenCheckpoint& w) {
  const auto sum = [](const std::vector<double>& parts) {
    S x = S(0);
    for (double part : parts) x += S(part);
    return x;
  };
  Checkpoint<S> c{sum(w.t), {}, {sum(w.size), sum(w.origin), w.taken}, w.signs, {}};
  for (const auto& parts : w.x) c.x.push_back(sum(parts));
  for (const auto& parts : w.lengths) c.lengths.push_back(sum(parts));
  return c;
}

inline py::dict as_dict(const Stiffness& s) {
  py::dict d;
  d["t"] = s.t, d["step"] = s.step, d["rate"] = s.rate, d["left"] = s.left, d["effect"] = s.effect, d["coordinate"] = s.coordinate, d["longest"] = s.longest;
  return d;
}

// Record a run. unit: of works in x. examine: describe what is stiff at a state, empty where it does not hold the steps; said: receives that text.
template <class S>
class Recorder : public Watcher<S> {
 public:
  using State = std::vector<S>;
  using Examine = std::function<std::optional<Stiffness>(const S& t, const State& x, const S& step, const S& last)>;
  Recorder(RunRecord& record, const S& unit, const py::object* progress, Examine examine = {}, const py::object* said = nullptr)
      : record_(record), unit_(unit), progress_(progress), examine_(std::move(examine)), said_(said) {}
  void step(const S& t, const State& x) override {
    if (record_.keeps_steps) append(record_.steps, t, x, record_.works);
  }
  void sample(const S& t, const State& x) override { append(record_.samples, t, x, record_.works); }
  void event(int number, const S& t, const State& x) override {
    record_.event_of.push_back(number);
    append(record_.events, t, x, 0);
  }
  bool stiff(const S& t, const State& x, const S& step, const S& last) override {
    if (!examine_ || !(record_.stiffness = examine_(t, x, step, last))) return false;
    if (said_) {
      const py::gil_scoped_acquire gil;
      (*said_)(as_dict(*record_.stiffness));
    }
    return true;
  }
  void progress(double t) override {
    if (!progress_) return;
    const py::gil_scoped_acquire gil;
    (*progress_)(t);
  }

 private:
  void append(Rows& to, const S& t, const State& x, int works) {
    to.t.push_back(to_double(t));
    const S* from = x.data();
    const auto part = [&](std::vector<double>& out, int n, const S& unit) {
      for (int i = 0; i < n; ++i) out.push_back(to_double(S(unit * *from++)));
    };
    part(to.q, record_.nq, S(1)), part(to.v, record_.nv, S(1)), part(to.own, record_.own, S(1)), part(to.work, works, unit_);
  }
  RunRecord& record_;
  S unit_;
  const py::object* progress_;
  Examine examine_;
  const py::object* said_;
};

}  // namespace pycraft
