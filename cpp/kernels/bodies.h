// What the sweeps over many columns read of a model at a state: the numbers of rigid/rigid_blocks.h where they lie. Plain data, as links.h.
#pragma once

#include <cstddef>

#include "kernels/links.h"

namespace pycraft::kernels {

// What is known of a body beyond its numbers. pin_x, pin_y, pin_z: its one row of H is that coordinate axis or its opposite, in the angular
// part; level_x, ...: and its frame is turned against its parent's about that axis alone.
enum class Way : unsigned char { any, pin_x, pin_y, pin_z, level_x, level_y, level_z };

template <class T>
struct Bodies {
  int count;
  const int* parent;      // -1: the base
  const int* first;       // of each body's coordinates, and their number
  const Way* way;
  const unsigned char* branches;  // has a child besides the body that follows it
  const T* pose;          // R by rows, then p
  const T* inertia;       // ten numbers: mass, first moment, rotational inertia xx, xy, xz, yy, yz, zz
  const T *H, *G;         // six numbers a coordinate
  const T* J;             // rotor inertia, a number a coordinate
  const T *D, *L;         // of each body from at[k] on: D(k), and L of D = L d L*
  const size_t* at;
  const T* pivots;        // d
  void (*interrupt)();    // asked in long loops; it throws to stop them
};

// Links that were eliminated at a state.
template <class T>
struct EliminatedLinks {
  const Links<T>* links;
  const int* room;        // where each link that branches has its six rows
  const T* kept;          // what `eliminate` left
  void (*interrupt)();
};

// On m columns, row-major, of one type: y = f(x), x and y apart from each other, in `scratch` of six numbers a body (of links, a room) and column.
template <class T, class Of = Bodies<T>>
using ColumnKernel = void (*)(const Of& of, const T* x, T* y, int m, T* scratch);
// ℳ⁻¹ by links (link_columns.h).
template <class T>
struct InverseByLinks {
  size_t (*size)(const Links<T>& links);   // of `kept`, in numbers; it is aligned to 64 bytes
  bool (*eliminate)(const Links<T>& links, const T* q, void (*interrupt)(), T* kept);  // false where a pivot is in doubt
  ColumnKernel<T, EliminatedLinks<T>> one, many;                                       // columns
};
template <class T>
struct ColumnKernels {
  ColumnKernel<T> mass_matrix_inverse;
  ColumnKernel<T> mass_matrix[2];   // without J, with it
  InverseByLinks<T> links;
};

}  // namespace pycraft::kernels
