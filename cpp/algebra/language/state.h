// A state of a model: immutable once made, so that readers in several threads need no lock.
#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

namespace pycraft {

// Numbers that several hold: all of a vector, or a run of another's, without a copy.
class SharedNumbers {
 public:
  SharedNumbers() : SharedNumbers(std::vector<double>()) {}
  SharedNumbers(std::vector<double> numbers)  // NOLINT: a vector is one
      : held_(std::make_shared<const std::vector<double>>(std::move(numbers))), first_(0), size_(held_->size()) {}
  SharedNumbers run(size_t first, size_t size) const {
    SharedNumbers part = *this;
    part.first_ = first_ + first, part.size_ = size;
    return part;
  }
  operator std::vector<double>() const { return copy(); }  // NOLINT: where a vector is wanted
  const double& operator[](size_t i) const { return data()[i]; }
  bool operator==(const std::vector<double>& other) const { return std::equal(begin(), end(), other.begin(), other.end()); }
  const double* data() const { return held_->data() + first_; }
  size_t size() const { return size_; }
  const double* begin() const { return data(); }
  const double* end() const { return data() + size_; }
  std::vector<double> copy() const { return {begin(), end()}; }
  // What keeps the numbers where they are.
  std::shared_ptr<const void> holder() const { return held_; }

 private:
  std::shared_ptr<const std::vector<double>> held_;
  size_t first_, size_;
};

struct StateData {
  SharedNumbers q, v;
};

}  // namespace pycraft
