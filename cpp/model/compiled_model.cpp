#include "model/compiled_model.h"

#include <algorithm>

#include "model/multibody.h"
#include "model/unit_data.h"
#include "runtime/interrupt.h"

namespace pycraft {

namespace {

// Coordinates of a hinge that move its body along any line whatever the others are, numbered from `first`: a free subhinge's, or three
// sliders'. None where one of them is prescribed, or has a rotor, whose inertia a change of the body's velocity does not share.
std::array<int, 3> translations(const Hinge& hinge, int first, const HingeTerms& terms) {
  std::vector<int> found;
  int j = 0;
  for (const Subhinge& h : hinge.subhinges) {
    for (int i = 0; i < h.record().translations; ++i) found.push_back(j + h.record().translation + i);
    j += h.nv();
  }
  const auto taken = [&](int i) { return hinge.rotor_inertia[i] != 0 || terms.is_driven(first + i) || terms.is_prescribed(first + i); };
  const bool driven = std::any_of(found.begin(), found.end(), taken);
  if (found.size() != 3 || driven) return {-1, -1, -1};
  return {first + found[0], first + found[1], first + found[2]};
}

// i where the row is e_i or -e_i exactly, else -1.
template <class S>
int axis_along(const Vector6<S>& row) {
  int found = -1;
  for (int i = 0; i < 6; ++i) {
    if (row[i] == S(0)) continue;
    if (found >= 0 || !(row[i] == S(1) || row[i] == S(-1))) return -1;
    found = i;
  }
  return found;
}

// The subhinge compiled, and along which coordinate axis its rows are at every q: only in the last of its hinge.
template <class S>
void add_subhinge(CompiledModel<S>& model, const Subhinge& given, bool last) {
  const Vector3<S> axis = renormalised<S>(given.axis), point = cast<S>(given.point);
  const S pitch = S(given.pitch);
  with_subhinge(given.kind, [&](auto row) {
    const CompiledSubhinge<S> h{given.kind, row.twist(axis, point, pitch), axis, point, pitch};
    Vector6<S> rows[row.nv];
    row.rows(h, rows);
    for (const Vector6<S>& r : rows) model.aligned.push_back(last ? axis_along(r) : -1);
    model.subhinges.push_back(h);
  });
}

}  // namespace

template <class S>
std::shared_ptr<const CompiledModel<S>> compile_model(const Multibody& model, const HingeTerms& terms) {
  auto c = std::make_shared<CompiledModel<S>>();
  c->parameters = model.parameters();
  c->bodies = model.bodies();
  c->nq = model.nq();
  c->nv = model.nv();
  c->gravity = cast<S>(model.gravity());
  c->first_subhinge.push_back(0);
  for (int k = 0; k < model.bodies(); ++k) {
    check_interrupt_at(k);
    const Body& b = model.body(k);
    c->parent.push_back(b.parent);
    c->q_offset.push_back(model.q_offset(k));
    c->v_offset.push_back(model.v_offset(k));
    c->nv_of.push_back(b.hinge.nv());
    c->placement.push_back(renormalised<S>(b.hinge.placement));
    c->inertia.push_back(rigid_inertia(S(b.mass), cast<S>(b.com), cast<S>(b.inertia)));
    c->inertia_factors.push_back(inertia_factors<S>(b.mass, b.com, b.inertia));
    c->mass_properties.push_back({b.mass, b.com, b.inertia});
    for (const Subhinge& h : b.hinge.subhinges) add_subhinge(*c, h, &h == &b.hinge.subhinges.back());
    c->first_subhinge.push_back(static_cast<int>(c->subhinges.size()));
    c->translations.push_back(translations(b.hinge, c->v_offset.back(), terms));
    for (double j : b.hinge.rotor_inertia) {
      const S whole = S(j) + S(terms.inertia_of(static_cast<int>(c->rotor_inertia.size())));
      c->rotor_inertia.push_back(whole);
      c->has_rotor_inertia |= !(whole == S(0));
    }
  }
  return c;
}
#define PYCRAFT_INSTANTIATE(S) template std::shared_ptr<const CompiledModel<S>> compile_model<S>(const Multibody&, const HingeTerms&);
PYCRAFT_FOR_EACH_SCALAR(PYCRAFT_INSTANTIATE)
#undef PYCRAFT_INSTANTIATE

}  // namespace pycraft
