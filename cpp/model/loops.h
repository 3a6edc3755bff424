// What a model must keep to beside its tree: loops that close chains, points on surfaces and curves, wheels that roll, blades that do not slip sideways,
// couplings between coordinates. The model knows nothing of them, as it knows nothing of loose frames (frames.h).
//
// Each says one or more rows, numbers in order of declaration. A row of positions has a residual r(q), zero where it is kept; a row of
// velocities (rolling, blades) has none. All have Q θ̇ = 0; of positions Q is ∂r along θ̇ (recursions/loop_rows.h).
//
// Of two frames a and b the rows are functions of the pose of an end frame on b in an end frame on a. A loop's hinge stands there as a body's
// does between parent and body, a its parent: X_ab = placement · steps. Its end frames have z along its axis and the origin at its point:
//
//   weld          about x, y, z; along x, y, z        ball, gimbal   along x, y, z
//   pin           about x, y; along x, y, z           universal      between the axes; along x, y, z
//   slider        about x, y, z; along x, y           planar         about x, y; along z
//   cylindrical   about x, y; along x, y              free           none
//   screw         about x, y; along x, y; along and about z
//   custom        about x, y, z; along x, y, z: of these as many as it has freedoms hang on the others
//
// A universal hinge has z along its first axis in a, along its second in b. Three axes of a gimbal reach every rotation where the middle one is
// across the others; where it is not, a gimbal is a custom hinge, with end frames as a weld has.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <unordered_map>
#include <vector>

#include "model/frames.h"

namespace pycraft {

enum class PairKind { weld, pin, slider, screw, universal, cylindrical, planar, ball, free, custom, blade, wheel, rolling_ball, surface, curve };
// A row of the table of kinds: what its rows are called, and how many of the last ones are of velocities.
struct PairRecord {
  const char* name;
  std::vector<const char*> rows;
  int of_velocities = 0;
};
const PairRecord& record_of(PairKind kind);

// p·A p + b·p + c of a point p, in metres: a plane, a sphere, a cylinder, ...
struct Quadric {
  Matrix3<double> A{0, 0, 0, 0, 0, 0, 0, 0, 0};
  Vector3<double> b{0, 0, 0};
  double c = 0;
};

class Curve;  // model/curve.h

struct FramePair {
  std::string a, b;                              // empty: the base
  PairKind kind = PairKind::weld;
  Pose<double> end_a = Pose<double>::identity(), end_b = Pose<double>::identity();  // of the end frames on a and on b
  double number = 0;                             // screw: pitch, m/rad; universal: cosine between the axes; wheels and balls: radius, m
  Quadric surface;                               // of a surface, on a
  std::shared_ptr<const Multibody> permitted;    // of a custom hinge: one body on it
  std::shared_ptr<const Curve> curve;            // of a point on a curve, on a
};

// One coordinate of a coupling, and the polynomial of it that the coupling adds: coefficients of 1, q, q², ...
struct CoupledCoordinate {
  std::string hinge;
  int coordinate = 0;                            // within the hinge
  std::vector<double> coefficients;
};
// r of the coordinates, its derivatives, its second derivatives (a square) and third ones (a cube): a user's, in double precision. `third` is null
// where they are not wanted; where they are, EvaluationError from a function that has none.
using CouplingFunction = std::function<void(const double* q, double* r, double* gradient, double* second, double* third)>;
struct Coupling {
  std::vector<CoupledCoordinate> coordinates;
  double constant = 0;                           // r = constant + Σ polynomial(q_i)
  CouplingFunction function;                     // or this
};

struct Loop {
  std::string name;
  FramePair pair;
  Coupling coupling;
  bool is_coupling() const { return !coupling.coordinates.empty(); }
};

// Loops as the structure has them now: ways and numbers of coordinates.
struct ResolvedLoop {
  std::shared_ptr<const Loop> loop;
  int first_row, rows;
  FramePath path;                                // of a pair: from the end frame on b to the one on a
  std::vector<int> q, v;                         // of a coupling: each coordinate's place in q and in v
};
struct ResolvedLoops {
  std::vector<ResolvedLoop> loops;
  int rows = 0;
  std::vector<std::string> names;                // of rows: "loop: direction"
  std::vector<bool> of_positions;                // rows
  std::deque<Pose<double>> poses;                // what paths point to
};

class LoopSet {
 public:
  explicit LoopSet(std::shared_ptr<Multibody> model) : frames_(std::move(model)) {}
  const Multibody& model() const { return frames_.model(); }
  const std::shared_ptr<Multibody>& shared_model() const { return frames_.shared_model(); }

  // ModelError names the loop and leaves all as it was: a name that is taken, ends on one body, hinges that have no rows, numbers that are none.
  // `hinge` is complete with its placement on a.
  void add_hinge(const std::string& name, const std::string& a, const std::string& b, const Hinge& hinge);
  // Blades, wheels, balls, surfaces, curves: the end frames as they are.
  void add_pair(const std::string& name, FramePair pair);
  void add_coupling(const std::string& name, Coupling coupling);
  void remove(const std::string& name);
  std::vector<std::string> names() const;        // in order of declaration
  const Loop& loop(const std::string& name) const;
  std::uint64_t edits() const { return edits_; } // another number after every change of the set
  // ModelError that names the loop where a body, node or hinge of one is no longer there. Kept until the structure or a parameter changes.
  std::shared_ptr<const ResolvedLoops> resolved() const;

 private:
  void check_new(const std::string& name) const;
  void keep(Loop loop);
  std::string body_of(const std::string& frame) const;  // empty: the base
  ResolvedLoop resolve(const std::shared_ptr<const Loop>& loop, std::deque<Pose<double>>& poses) const;

  FrameTree frames_;
  std::vector<std::shared_ptr<const Loop>> loops_;
  std::unordered_map<std::string, std::shared_ptr<const Loop>> by_name_;
  std::uint64_t edits_ = 0;
  mutable std::shared_ptr<const ResolvedLoops> resolved_;
  mutable std::uint64_t parameters_ = 0, seen_edits_ = 0;
  mutable size_t nodes_ = 0;
  mutable Mutex mutex_;
};

}  // namespace pycraft
