// What the sweeps over many columns read of a model at a state: the numbers of rigid/rigid_blocks.h where they lie. Plain data, as links.h.
#pragma once

#include <cstddef>

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

// On m columns, row-major, of one type: y = f(x), x and y apart from each other, in `scratch` of six numbers a body and column.
template <class T>
using ColumnKernel = void (*)(const Bodies<T>& bodies, const T* x, T* y, int m, T* scratch);
template <class T>
struct ColumnKernels {
  ColumnKernel<T> mass_matrix_inverse;
  ColumnKernel<T> mass_matrix[2];   // without J, with it
};

}  // namespace pycraft::kernels
