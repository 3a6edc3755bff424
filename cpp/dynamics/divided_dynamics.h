// Forward dynamics by divide and conquer (recursions/divide_and_conquer.h) over an assembly tree (assembly_tree.h), in threads.
//
// Four passes over the assembly tree: rotations inwards and velocities outwards, segments inwards, motions and forces outwards. A node has to
// do with what is inside it and with nothing beside it, so pieces of the tree go to threads, and every node has the same bits in any number.
//
// No pivot and no spread of inertias says how many digits are left, the equations of motion do. Of every solution θ̈
//
//   r = T - (ℳ + J) θ̈ - 𝒞,   δ = (ℳ + J)⁻¹ r
//
// is formed, r by Newton-Euler's two sweeps, with forces of masses that are no rounded inertias gathered in a wider scalar, δ by the segments that
// are there. Where |δ| is at most 100 eps √nv |θ̈| the solution stands: so much is lost where nothing cancels. Else δ is added as long as it
// shrinks and is more than the rounding of r can have made
// (algebra/trees/sweeps/residual_rounding.h), and what may be left, the last δ or the most that this rounding makes in any direction, must be
// below `faint_limit` of θ̈, six digits, or is refused by an error that names the hinge where they went. Where a pivot is so small that it may
// be noise, the articulated-body algorithm in its form ud names the hinge that feels no inertia, or finds none.
//
// Accelerations that are zero but for rounding, as of what rests under forces that cancel, have no digits of their own: 100 eps √nv of gravity, ω²
// and forces over inertias is let through.
//
// Cost: r is one thread's sweep, O(N), δ the two passes below once more, of vectors alone. A correction that is looked into costs six δ more.
//
// No allocation after the first call, but for threads.
#pragma once

#include <memory>
#include <vector>

#include "dynamics/assembly_tree.h"
#include "dynamics/rigid_dynamics.h"
#include "recursions/applied.h"
#include "recursions/divide_and_conquer.h"
#include "recursions/point_accelerations.h"
#include "rigid/rigid_blocks.h"

namespace pycraft {

// What the blocks of a model are.
template <class S>
size_t bytes_of_blocks(const CompiledModel<S>& model) {
  const size_t body = sizeof(Pose<S>) + sizeof(RigidInertia<S>) + 4 * sizeof(Symmetric6<S>) + 6 * sizeof(S) + sizeof(size_t);
  size_t bytes = model.bodies * body + model.nv * (3 * sizeof(Vector6<S>) + 2 * sizeof(S) + sizeof(int));
  for (const int n : model.nv_of) bytes += 2 * size_t(n) * n * sizeof(S);
  return bytes;
}

template <class S>
class DividedDynamics {
 public:
  explicit DividedDynamics(const Multibody& model);

  // θ̈ at one state, right to six digits (in single precision to one, in wider ones to as many as in double) as far as the rounding of residuals
  // lets see. Throws SingularHingeError as the articulated-body algorithm does, SingularOperatorError where this alone has lost its digits.
  void forward_dynamics(const S* q, const S* v, const S* tau, S* vdot, const Applied<S>& applied, int threads);

  const AssemblyTree& assembly() const { return assembly_; }
  // Corrections that were added to the last solution.
  int corrections() const { return corrections_; }
  // Bytes that are held, most of which are read and written at one evaluation.
  size_t memory() const;

 private:
  struct Call {
    const S *q, *v, *tau;
    S* vdot;
    const Applied<S>& applied;
    int threads;
    bool correcting = false;  // (ℳ + J) θ̈ = T, with the segments that are there
  };
  // Of a segment: ω at its end is R*ω + w, ω where it hangs.
  struct Turn {
    Matrix3<S> R;
    Vector3<S> w;
    Vector3<S> of(const Vector3<S>& omega) const { return transpose_times(R, omega) + w; }
  };

  void lend_inertias();
  void turn(const Call& call, int node);
  void move(const Call& call, int node);
  void put_together(const Call& call, int node);
  void put_together_again(const Call& call, int node);
  void take_apart(const Call& call, int node);
  S body(const Call& call, int node);  // as eliminate() does
  S joined(int node);
  Rows<S> rows(int body);
  bool one_hinge(int node);                    // a segment whose end is a hinge of six rows at most
  void find_end(int node, End<S>& end);
  template <class F>
  void inwards(int threads, F f);
  template <class F>
  void outwards(int threads, F f);
  void start_at(const Vector6<S>& base);  // motions of the base, forces of nothing
  void solve(const Call& call, const S* r, S* x);
  void certify(const Call& call);
  S rounding_of_correction(const Call& call, const S& length);
  S most_rounding_of_corrections(const Call& call);
  S natural_acceleration(const Call& call, int coordinate) const;
  int body_of(int coordinate) const;
  void name_singular_hinge(const Call& call);  // by the articulated-body algorithm
  [[noreturn]] void refuse(double off, int worst) const;

  const Multibody& source_;
  const SkoStructure tree_;
  std::shared_ptr<const CompiledModel<S>> model_;
  const AssemblyTree assembly_;
  std::vector<AssemblyTree::Piece> pieces_;
  std::vector<int> rest_;
  int cut_for_ = 0;  // threads
  RigidBlocks<S> blocks_;  // poses, hinge maps and inertias
  // Per body.
  std::vector<LentInertia<S>> lent_;
  PointAccelerations<S> points_;
  std::vector<Vector6<S>> alpha_, interbody_;  // of Newton-Euler
  std::vector<Vector6<Wider<S>>> gathered_;    // forces
  std::vector<size_t> l_;                      // where L begins
  // Per coordinate, but for L.
  std::vector<Vector6<S>> b_, p_;
  std::vector<S> x_, eta_, L_, work_, residual_, delta_, direction_;
  // Per node.
  std::vector<Turn> turns_;
  std::vector<Vector3<S>> omega_;
  std::vector<Segment<S>> segments_;
  std::vector<Vector6<S>> motion_, force_;  // of what it hangs on, and of what hangs on it
  std::vector<double> growth_;              // of rounding, in it and inside of it; infinite: a pivot was not positive
  ResidualSizes<S> sizes_;                  // from where they are asked first
  std::unique_ptr<RigidDynamics<S>> articulated_;  // likewise
  int corrections_ = 0;
};

#define PYCRAFT_EXTERN(S) extern template class DividedDynamics<S>;
PYCRAFT_FOR_EACH_SCALAR(PYCRAFT_EXTERN)
#undef PYCRAFT_EXTERN

}  // namespace pycraft
