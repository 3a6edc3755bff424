// A model as the kernels of direct calls read it: links in a flat array, a step kind each, frames laid so that hinge axes are coordinate axes.
//
// A link is a body, or a massless piece between two subhinges of one hinge. Its frame is the kernels' own: rest_model.h says how it lies in
// the body's. Generalized coordinates are the model's, so that velocities, accelerations, forces, ℳ and ℳ⁻¹ are those of the model itself.
// Plain data: sources built for other instruction sets include this file, and hardly any of it is code.
#pragma once

#include <cstddef>

namespace pycraft::kernels {

// How a link moves against its parent. pin_x, pin_y, pin_z: its axes are the parent's at rest, turned about one of them; turned_pin: about z,
// after a fixed rotation; helix: a slider or a screw along z. A ball's centre and a free link's frame are the link's origin.
enum class Step : int { pin_x, pin_y, pin_z, turned_pin, helix, ball, free };

template <class T>
struct Link {
  Step step;
  int parent;                // -1: the base
  int q, v;                  // where its coordinates begin
  int end;                   // one past the last coordinate of the links outboard of it and its own
  bool branches;             // has children besides the one that follows it
  bool rotor;                // J is not zero
  bool oblique;              // its axis is no coordinate axis of the parent at rest
  bool prescribed;           // its acceleration is given and its force is found (prescribed_links.h)
  int multi;                 // of links with several coordinates: which of them, else -1
  int slot;                  // where sweeps outward that keep columns have this link's: its parent's, where it is the last child
  T sign;                    // -1: the hinge turns or slides against the coordinate axis
  T R[9], p[3];              // of the frame before the step in the parent's
  T mass, moment[3], rotational[6];
  T J;
  T turn, travel;            // of a helix, for a unit of its coordinate
  // Of what it carries, for the bound below which a pivot is in doubt: the sum of traces, the mass, the length of the longest way outward and of
  // its longest piece.
  T carried_rotational, carried_mass, furthest, longest;
};

// A link's own inertia as a sum of weighted squares (model/inertia_factors.h), for the forms that carry factors (factored_columns.h).
template <class T>
struct LinkFactors {
  bool kept;          // the hinge's row is one more than the body's, and none of these becomes zero: a rotor, or a screw
  bool empty, whole;  // has no mass; has inertia along every axis
  int row[6];         // where each row of the body is: first those that the hinge makes zero, then angular ones, then linear ones
  int fours;          // of columns
  int rotor;          // the column of its rotor, -1: none
  int room, to;       // of a link that branches, where its columns are, in fours; of one that does not follow its parent, where they go
  T own[72];          // six columns in their places among eight (factored_columns.h)
  T com[3], about[6]; // centre of mass, inertia about it
  T mass_root;        // scale of the three columns of the mass
  T acceleration[9];  // of the other three, of a couple about the centre: what of it they take up
  T left[9];          // and what of the couple they do not
  T uncertain;        // of what it carries: inertia that was taken for rounding
};

// Bounds of doubt, see pivots.h and factored_pivots.h.
template <class T>
struct Bounds {
  T rounding, faint, growth, gain;
};

template <class T>
struct Links {
  int count, nq, nv;
  int multiple, slots;          // links with several coordinates; links whose columns are kept at once
  const Link<T>* link;
  const double* wide_masses;    // twenty a link: mass, moment, rotational, then what rounding took from these
  bool several = false;         // whether a hinge is several links: of its pivots the general recursions decide
  bool prescribed = false;      // whether any link is: for forward dynamics alone, in the form fast
  const LinkFactors<T>* factors[2] = {};  // in the form ud, and scaled by the roots of the weights
  int fours = 0;                // of columns, of links that branch
  Bounds<T> plain, factored;    // of the form fast, and of the others
};

// A node as part of a link, -1: of the base.
template <class T>
struct OnLink {
  int link;
  T R[9], p[3];
  int place = 0;  // among the nodes of a call
};

// States to compute at: state b at q + b q_stride, and so on; lanes beyond `states` repeat the last one.
template <class T>
struct States {
  const double *q, *v, *u;
  size_t q_stride, v_stride, u_stride;
  int states;
  const T* gravity;   // three numbers
  const T* wrenches;  // (n; f) on every link in its frame about its origin, at all states; null: none
  void (*interrupt)();  // asked in long loops; it throws to stop them
  const OnLink<T>* node = nullptr;  // of calls that are asked of one, or of several, in the order of their links
  int nodes = 0;
  double* const* others = nullptr;  // where further results of a call go, as the first
  const T *cosines = nullptr, *sines = nullptr;  // of one state: of every coordinate
  T gone = 0;                                    // of one state in parts: what sliders add to lengths
  int steps = 0;             // of a refined call: corrections at most
  size_t gravity_stride = 0, wrench_stride = 0;  // of plain forward dynamics in packs of doubles: where each state has its own; 0: all have the same
};

// What a call is: `run` writes the results to out + b out_stride, in `work`, aligned to 64 bytes and of as many numbers as the other function
// says. Bit b of what comes back says that state b is sound: of others the results mean nothing, and the general recursions decide.
template <class T>
struct Kernel {  // null: not there
  unsigned (*run)(const Links<T>& links, const States<T>& states, double* out, size_t out_stride, T* work);
  size_t (*work)(const Links<T>& links, int nodes);
};

// Calls of one state piece by piece (tree_parts.h), each of links first..last: a piece of the trunk, or `apart` a subtree. What is null the
// call does without.
template <class T>
struct PartKernel {
  States<T> (*begin)(const Links<T>& links, const States<T>& states, T* work);  // how the others are to be given the state
  void (*outward)(const Links<T>& links, const States<T>& at, int first, int last, T* work);
  void (*clear)(const Links<T>& links, int first, int last, T* work);  // before inward and errors
  unsigned (*inward)(const Links<T>& links, const States<T>& at, int first, int last, bool apart, double* out, T* work);  // whether it is sound
  unsigned (*errors)(const Links<T>& links, const States<T>& at, int first, int last, bool apart, double* out, T* work);  // the same, where it is not
  void (*join)(const Links<T>& links, int root, T* work);  // a subtree to the trunk, in the order that inward has
  void (*finish)(const Links<T>& links, const States<T>& at, int first, int last, double* out, T* work);
};

// Those in factored forms last.
enum class Call {
  forward_dynamics, inverse_dynamics, mass_matrix, mass_matrix_inverse, inverse_dynamics_derivatives, forward_dynamics_derivatives, jacobian, pose,
  coriolis_matrix, skew_coriolis_matrix, operational_space_compliance, operational_space_inertia,
  refined_dynamics, gathered_dynamics,
  forward_dynamics_ud, refined_dynamics_ud, gathered_dynamics_ud,
  forward_dynamics_square_root, refined_dynamics_square_root, gathered_dynamics_square_root
};

template <class T>
struct Kernels {
  int lanes;           // states at once
  Kernel<T> calls[20];
  PartKernel<T> in_parts[2];  // of forward and inverse dynamics; of one state alone
  const Kernel<T>& operator[](Call call) const { return calls[static_cast<int>(call)]; }
};

}  // namespace pycraft::kernels
