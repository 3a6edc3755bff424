// Values of a tree whose coordinates stand in vectors of Θ in another order than body after body: those of grouped bodies, which keep the order of the
// model that they are made of. The sweeps know only their own order; vectors are put into it and back.
#pragma once

#include <algorithm>
#include <vector>

#include "algebra/trees/tree_values.h"

namespace pycraft {

template <BlockPolicy Blocks>
class ReorderedValues : public TreeValues<Blocks> {
  using Base = TreeValues<Blocks>;

 public:
  using S = typename Blocks::Scalar;

  template <class... Arguments>
  explicit ReorderedValues(const SkoSource& source, Arguments&&... arguments) : Base(source.structure(), std::forward<Arguments>(arguments)...) {
    const Space theta = source.theta();
    for (const std::vector<int>& blocks : theta.layout().of_body)
      for (int b : blocks)
        for (int i = 0; i < theta.layout().blocks[b].size; ++i) place_.push_back(theta.layout().blocks[b].offset + i);
    in_order_ = std::is_sorted(place_.begin(), place_.end());
  }

  void apply(const Symbol& symbol, bool transposed, bool inverse, const S* x, S* y, int m) const override {
    const SymbolDefinition& d = *symbol.definition;
    const bool from_theta = (transposed ? d.codomain : d.domain) == SpaceKind::Theta, to_theta = (transposed ? d.domain : d.codomain) == SpaceKind::Theta;
    if (in_order_ || !(from_theta || to_theta)) return Base::apply(symbol, transposed, inverse, x, y, m);
    const Room input(from_theta ? size(m) : 0), output(to_theta ? size(m) : 0);
    Base::apply(symbol, transposed, inverse, from_theta ? in_order(x, m, input) : x, to_theta ? output.data() : y, m);
    if (to_theta) put_back(output, y, m);
  }
  void mass_matrix(bool with_hinge_diagonal, const S* x, S* y, int m, S* scratch) const override {
    if (in_order_) return Base::mass_matrix(with_hinge_diagonal, x, y, m, scratch);
    const Room input(size(m)), output(size(m));
    Base::mass_matrix(with_hinge_diagonal, in_order(x, m, input), output.data(), m, scratch);
    put_back(output, y, m);
  }
  void mass_matrix_inverse(const S* x, S* y, int m, S* scratch) const override {
    if (in_order_) return Base::mass_matrix_inverse(x, y, m, scratch);
    const Room input(size(m)), output(size(m));
    Base::mass_matrix_inverse(in_order(x, m, input), output.data(), m, scratch);
    put_back(output, y, m);
  }
  void mass_matrix_rounding(const S* x, const S* b, const S* w, const RoundingUnits<S>& units, S* out, int m, ResidualSizes<S>& sizes) const override {
    if (in_order_) return Base::mass_matrix_rounding(x, b, w, units, out, m, sizes);
    const Room xs(size(m)), bs(size(m)), ws(size(m));
    Base::mass_matrix_rounding(in_order(x, m, xs), in_order(b, m, bs), in_order(w, m, ws), units, out, m, sizes);
  }
  void mass_matrix_dense(bool with_hinge_diagonal, S* out) const override {
    if (in_order_) return Base::mass_matrix_dense(with_hinge_diagonal, out);
    const size_t n = place_.size();
    const Room own(n * n);
    Base::mass_matrix_dense(with_hinge_diagonal, own.data());
    for (size_t i = 0; i < n; ++i)
      for (size_t j = 0; j < n; ++j) out[place_[i] * n + place_[j]] = own.data()[i * n + j];
  }

 private:
  // Numbers of one call, from a stock of the thread's.
  class Room {
   public:
    explicit Room(size_t size) : numbers_(taken()) { numbers_.resize(size); }
    ~Room() { stock().push_back(std::move(numbers_)); }
    Room(const Room&) = delete;
    S* data() const { return numbers_.data(); }

   private:
    static std::vector<std::vector<S>>& stock() {
      thread_local std::vector<std::vector<S>> rooms;
      return rooms;
    }
    static std::vector<S> taken() {
      if (stock().empty()) return {};
      std::vector<S> room = std::move(stock().back());
      stock().pop_back();
      return room;
    }
    mutable std::vector<S> numbers_;
  };

  size_t size(int m) const { return place_.size() * m; }
  const S* in_order(const S* x, int m, const Room& room) const {
    for (size_t i = 0; i < place_.size(); ++i) std::copy_n(x + place_[i] * m, m, room.data() + i * m);
    return room.data();
  }
  void put_back(const Room& own, S* y, int m) const {
    for (size_t i = 0; i < place_.size(); ++i) std::copy_n(own.data() + i * m, m, y + place_[i] * m);
  }

  std::vector<size_t> place_;  // in vectors of Θ, of each coordinate of the sweeps
  bool in_order_ = true;
};

}  // namespace pycraft
