// Forward dynamics by divide and conquer (recursions/divide_and_conquer.h) over an assembly tree (assembly_tree.h), in threads.
//
// Four passes over the assembly tree: rotations inwards and velocities outwards, segments inwards, motions and forces outwards. A node has to
// do with what is inside it and with nothing beside it, so pieces of the tree go to threads, and every node has the same bits in any number.
//
// Where a pivot is so small against what was added up in it that few digits may be left, or inertias are so far apart, the articulated-body
// algorithm in its form ud decides: it names the hinge that feels no inertia, and accelerations that are not its own to six digits are refused.
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

namespace pycraft {

template <class S>
class DividedDynamics {
 public:
  explicit DividedDynamics(const Multibody& model);

  // θ̈ at one state. Throws SingularHingeError as the articulated-body algorithm does, SingularOperatorError where this alone has lost its digits.
  void forward_dynamics(const S* q, const S* v, const S* tau, S* vdot, const Applied<S>& applied, int threads);

  const AssemblyTree& assembly() const { return assembly_; }
  // Bytes read and written at one evaluation.
  size_t memory() const;

 private:
  struct Call {
    const S *q, *v, *tau;
    S* vdot;
    const Applied<S>& applied;
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
  void judge(const Call& call, double growth);  // by the articulated-body algorithm
  [[noreturn]] void refuse(double off, int worst) const;

  const Multibody& source_;
  const SkoStructure tree_;
  std::shared_ptr<const CompiledModel<S>> model_;
  const AssemblyTree assembly_;
  std::vector<AssemblyTree::Piece> pieces_;
  std::vector<int> rest_;
  int cut_for_ = 0;  // threads
  // Per body.
  std::vector<LentInertia<S>> lent_;
  std::vector<Pose<S>> pose_;
  PointAccelerations<S> points_;
  std::vector<size_t> l_;         // where L begins
  // Per coordinate, but for L.
  std::vector<Vector6<S>> H_, b_, p_;
  std::vector<S> x_, eta_, L_, work_;
  // Per node.
  std::vector<Turn> turns_;
  std::vector<Vector3<S>> omega_;
  std::vector<Segment<S>> segments_;
  std::vector<Vector6<S>> motion_, force_;  // of what it hangs on, and of what hangs on it
  std::vector<double> growth_;              // of rounding, in it and inside of it; infinite: a pivot was not positive
  double spread_ = 1;                       // of inertias
  std::unique_ptr<RigidDynamics<S>> articulated_;  // from where it is asked first
  std::vector<S> expected_;
};

#define PYCRAFT_EXTERN(S) extern template class DividedDynamics<S>;
PYCRAFT_FOR_EACH_SCALAR(PYCRAFT_EXTERN)
#undef PYCRAFT_EXTERN

}  // namespace pycraft
