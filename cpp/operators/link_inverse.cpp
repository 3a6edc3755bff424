#include "operators/link_inverse.h"

#include "kernels/instruction_set.h"
#include "kernels/recorded_columns.h"
#include "runtime/interrupt.h"

namespace pycraft {

namespace {

template <class S>
const kernels::InverseByLinks<S>& kernels_of() {
  if constexpr (is_recorded<S>)
    return kernels::recorded_columns.links;
  else
    return kernels::instruction_set().columns.links;
}

// The same numbers, as constants.
void convert(const kernels::Link<double>& from, kernels::Link<Recorded>& to) {
  to.step = from.step, to.parent = from.parent, to.q = from.q, to.v = from.v, to.end = from.end, to.branches = from.branches;
  to.rotor = from.rotor, to.oblique = from.oblique, to.prescribed = from.prescribed, to.multi = from.multi, to.slot = from.slot;
  const auto numbers = [](const auto& a, auto& b) { std::copy(std::begin(a), std::end(a), std::begin(b)); };
  numbers(from.R, to.R), numbers(from.p, to.p), numbers(from.moment, to.moment), numbers(from.rotational, to.rotational);
  to.sign = from.sign, to.mass = from.mass, to.J = from.J, to.turn = from.turn, to.travel = from.travel;
  to.carried_rotational = from.carried_rotational, to.carried_mass = from.carried_mass, to.furthest = from.furthest, to.longest = from.longest;
}

}  // namespace

KnownLinks::KnownLinks(const Multibody& of) : parameters(of.parameters()), model(kernels::LinkModel<double>::of(of)) {
  if (!model) return;
  const kernels::Links<double>& links = model->links();
  int rooms = 0;
  for (int k = 0; k < links.count; ++k) room.push_back(links.link[k].branches ? rooms++ : -1);
}

template <class S>
void LinkInverse<S>::take(std::shared_ptr<const KnownLinks> known) {
  there_ = false;
  known_ = std::move(known);
  if (!known_->model) return;
  const kernels::Links<double>& links = known_->model->links();
  if constexpr (is_recorded<S>) {
    all_.resize(links.count);
    for (int k = 0; k < links.count; ++k) convert(links.link[k], all_[k]);
    links_ = {links.count, links.nq, links.nv, links.multiple, links.slots, all_.data(), nullptr, links.several};
    const auto& [rounding, faint, growth, gain] = links.plain;
    links_.plain = {rounding, faint, growth, gain};
  } else {
    links_ = links;
  }
  const size_t size = kernels_of<S>().size(links_);
  if (size <= size_) return;
  kept_.reset(static_cast<S*>(::operator new(size * sizeof(S), std::align_val_t(64))));
  size_ = size;
}

template <class S>
bool LinkInverse<S>::eliminate(const S* q) {
  return there_ = known_->model && kernels_of<S>().eliminate(links_, q, check_interrupt, kept_.get());
}

template <class S>
void LinkInverse<S>::apply(const S* x, S* y, int m, S* scratch) const {
  const kernels::InverseByLinks<S>& by = kernels_of<S>();
  (m == 1 ? by.one : by.many)({&links_, known_->room.data(), kept_.get(), check_interrupt}, x, y, m, scratch);
}

template class LinkInverse<double>;
template class LinkInverse<Recorded>;

}  // namespace pycraft
