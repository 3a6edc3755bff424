#include "dynamics/centroidal.h"

#include "recursions/kinematics.h"
#include "runtime/errors.h"

namespace pycraft {

template <class S>
Centroidal<S>::Centroidal(const Multibody& model)
    : source_(model), model_(model.compiled<S>()), blocks_(model.structure()), frame_(*model_), sums_(*model_) {}

template <class S>
const MassCentre<S>& Centroidal<S>::fill(const S* q, const S* v) {
  kinematics(*model_, q, blocks_);
  frame_.fill(*model_, blocks_, Vector3<S>::zero(), v, nullptr);
  const MassCentre<S>& all = sums_.fill(*model_, blocks_, frame_);
  if (!(all.mass > S(0))) throw ModelError("'" + source_.name() + "' has no mass and so no centre of mass: give one of its bodies a mass");
  return all;
}

template <class S>
void Centroidal<S>::sum(const S* q, const S* v, S* out) {
  const MassCentre<S>& all = fill(q, v);
  const Matrix3<S> inertia = full(all.inertia);
  for (int i = 0; i < 3; ++i) out[i] = all.position[i], out[3 + i] = all.velocity[i];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) out[6 + 3 * i + j] = inertia(i, j);
  for (int i = 0; i < 6; ++i) out[15 + i] = all.momentum[i];
}

template <class S>
void Centroidal<S>::columns(const S* q, const S* v, S* matrix, S* rate, S* dq) {
  fill(q, v);
  sums_.columns(*model_, blocks_, frame_, matrix, rate, dq);
}

#define PYCRAFT_INSTANTIATE(S) template class Centroidal<S>;
PYCRAFT_FOR_EACH_SCALAR_TO_QUAD(PYCRAFT_INSTANTIATE)
#undef PYCRAFT_INSTANTIATE

}  // namespace pycraft
