// ℳ⁻¹ of a robot on columns by its links (kernels/link_columns.h), which are eliminated at one state after another.
#pragma once

#include <memory>
#include <new>
#include <vector>

#include "kernels/bodies.h"
#include "kernels/link_model.h"
#include "operators/many_columns.h"

namespace pycraft {

// A model as links; null where kernels do not know a hinge. room: where those that branch keep their columns, -1: nowhere.
struct KnownLinks {
  explicit KnownLinks(const Multibody& of);
  std::uint64_t parameters;
  std::unique_ptr<const kernels::LinkModel<double>> model;
  std::vector<int> room;
};

template <class S>
class LinkInverse {
 public:
  // Of a model whose numbers are others now.
  void take(std::shared_ptr<const KnownLinks> known);
  bool taken() const { return known_ != nullptr; }
  void forget() { known_ = nullptr, there_ = false; }
  // At the configuration q. False where links are not known, or leave a pivot in doubt.
  bool eliminate(const S* q);
  // Whether there is one, of the state that was eliminated last.
  bool there() const { return there_; }
  void leave() { there_ = false; }
  // y = ℳ⁻¹x of m columns, x and y apart from each other; scratch: six numbers a body and column.
  void apply(const S* x, S* y, int m, S* scratch) const;

 private:
  struct Free {
    void operator()(S* x) const { ::operator delete(x, std::align_val_t(64)); }
  };
  std::shared_ptr<const KnownLinks> known_;
  kernels::Links<S> links_{};
  std::vector<kernels::Link<S>> all_;  // where they are not the model's own
  std::unique_ptr<S, Free> kept_;
  size_t size_ = 0;
  bool there_ = false;
};

// Other scalars go by the sweeps.
template <class S>
  requires(!by_columns<S>)
class LinkInverse<S> {};

}  // namespace pycraft
