// The tree of frames: the base, bodies on their hinges, nodes on bodies, and loose frames that stand on any of these or on each other, fixed or
// moved by a function of time. The model knows nothing of loose frames: nothing of its own stands on one.
//
// A frame is called by its name. Two of no body or node are the base's: "base" and "world"; where the model has a body or node of that name it is
// that one, and the base is "".
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "model/multibody.h"

namespace pycraft {

// What a function of time says of a frame on what carries it: its pose, and where they are known its twist (ω; v), in its own axes about its own
// origin, and the rate of these six numbers.
struct FrameMotion {
  Pose<double> pose = Pose<double>::identity();
  std::optional<Vector6<double>> velocity, acceleration;
};
using FrameFunction = std::function<FrameMotion(double t)>;

struct LooseFrame {
  std::string name, on;    // on: the name of what carries it, empty for the base
  Pose<double> pose = Pose<double>::identity();  // of one that is fixed there
  FrameFunction motion;    // of one that moves there
  std::uint64_t edited = 0;  // when it was made, moved or attached, by FrameTree::edits
};

// A frame by number: -1 the base, k body k, bodies + i node i, -2 - j loose frame j. As long as the structure stays and the frame is there.
using FrameNumber = int;
inline constexpr FrameNumber base_frame = -1;

// A step from a frame to what carries it: over the hinge of a body, or from a node or loose frame.
struct FrameStep {
  enum class Kind { hinge, fixed, moved } kind;
  int number;                         // hinge: the body; moved: the loose frame
  const Pose<double>* pose;           // fixed
  std::uint64_t edited;               // fixed and moved: the loose frame's, 0 of a node
};
// From a frame up to the nearest that carries both, and from there down to another one.
struct FramePath {
  std::vector<FrameStep> up, down;    // outermost first; innermost first
};

class FrameTree {
 public:
  explicit FrameTree(std::shared_ptr<Multibody> model) : model_(std::move(model)) {}
  const Multibody& model() const { return *model_; }
  const std::shared_ptr<Multibody>& shared_model() const { return model_; }

  // A question in progress: as long as it lives neither the model nor its frames are edited.
  class InUse {
   public:
    explicit InUse(const FrameTree& frames) : frames_(frames), model_(*frames.model_), entered_(frames.use_.enter()) {}
    ~InUse() { frames_.use_.leave(entered_); }
    InUse(const InUse&) = delete;

   private:
    const FrameTree& frames_;
    ModelInUse model_;
    unsigned entered_;
  };

  // ---- loose frames; each edit raises edits(). ModelError names the frame and leaves all as it was.
  void add(const std::string& name, const std::string& on, const Pose<double>& pose, FrameFunction motion = nullptr);
  void move(const std::string& name, const Pose<double>& pose);
  void move(const std::string& name, FrameFunction motion);
  void attach(const std::string& name, const std::string& on);  // its pose, or its motion, is then the one on that frame
  void remove(const std::string& name);                         // not where others stand on it
  std::uint64_t edits() const { return edits_; }
  std::vector<std::string> loose_names() const;                 // sorted
  bool is_loose(const std::string& name) const { return numbers_.count(name) > 0; }
  const LooseFrame& loose(const std::string& name) const;
  const LooseFrame& loose(FrameNumber number) const { return *frames_[-2 - number]; }

  // ---- any frame
  FrameNumber find(const std::string& name) const;              // ModelError with near names
  std::string name(FrameNumber frame) const;                    // empty for the base
  FrameNumber carrier(FrameNumber frame) const;                 // what it stands on; ModelError where that was removed
  // Cost: the number of steps.
  FramePath path(FrameNumber frame, FrameNumber other) const;

 private:
  // Nobody asks meanwhile. Throws where somebody does: a function of time that edits frames.
  class Edit {
   public:
    explicit Edit(FrameTree& frames);
    ~Edit() { use_.end_edit(); }
    Edit(const Edit&) = delete;

   private:
    UseCount& use_;
  };
  std::optional<FrameNumber> known(const std::string& name) const;
  std::optional<FrameNumber> of_model(const std::string& name) const;
  void check_new(const std::string& name) const;
  LooseFrame& of(const std::string& name);
  std::vector<FrameNumber> outside(FrameNumber frame) const;    // the frame, what it stands on, ..., a body or the base
  FrameStep step(FrameNumber frame) const;

  std::shared_ptr<Multibody> model_;
  std::vector<std::unique_ptr<LooseFrame>> frames_;             // null where one was removed
  std::map<std::string, int> numbers_;                          // places in frames_
  std::uint64_t edits_ = 0;
  // Whether the model has bodies or nodes called so, kept as long as it has the same: finding nothing takes it long.
  struct Unknown {
    std::uint64_t parameters = 0;
    size_t nodes = 0;
    bool unknown = false;
  };
  mutable std::map<std::string, Unknown> base_names_ = {{"base", {}}, {"world", {}}};
  mutable Mutex mutex_;
  mutable UseCount use_;
};

}  // namespace pycraft
