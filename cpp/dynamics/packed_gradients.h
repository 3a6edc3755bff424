// Gradients of ln det(ℳ + J) in packs, of batches and of one state after another: the recursion runs once on numbers that write down what is
// done to them (numerics/recorded.h), and that is done again at the states, with the bits that it has by itself. It is the shorter way for one
// state, too: what is zero or one in the model is left out, and nothing is decided.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "lanes/replayed.h"
#include "model/multibody.h"

namespace pycraft {

enum class GradientOver { coordinates, inertias, geometry, axes };
int gradient_size(const Multibody& model, GradientOver over);

// The recursion on q of a model, for many states and for few.
struct GradientPrograms {
  kernels::Program of_many, of_few;
};
// Null where it cannot be recorded.
std::shared_ptr<const GradientPrograms> recorded_gradient(const Multibody& model, GradientOver over);

class PackedGradients {
 public:
  // Whether so many more states are done in packs: from `least` on since the model's numbers changed, as long as recording takes.
  bool worth(const Multibody& model, GradientOver over, int states);
  // Which states are left; all of them where nothing could be recorded.
  std::vector<int> run(const Multibody& model, GradientOver over, const double* q, int states, double* out);

 private:
  static constexpr int least = 64;
  struct Kept {
    std::uint64_t parameters = 0;
    int asked = 0;
    bool tried = false;
    std::shared_ptr<const GradientPrograms> programs;
  };
  Mutex mutex_;
  std::map<GradientOver, Kept> kept_;
  kernels::Rooms rooms_;
};

}  // namespace pycraft
