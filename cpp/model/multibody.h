// The DARTS side: bodies on hinges in a tree, nodes on bodies, a state, gravity. Structure is edited here; numbers are checked here.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <set>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "algebra/language/source.h"
#include "model/hinge.h"
#include "model/part.h"
#include "runtime/mutex.h"
#include "spatial/rigid_inertia.h"

namespace pycraft {

struct Body {
  std::string name;
  int parent = -1;                          // -1: the base
  double mass = 0;                          // kg
  Vector3<double> com{0, 0, 0};             // in the body frame
  Symmetric3<double> inertia{0, 0, 0, 0, 0, 0};  // about the centre of mass, in the body's axes
  Hinge hinge;
};

// A frame on a body (or on the base): a welded link, a sensor, a tool.
struct Node {
  std::string name;
  int body = -1;
  Pose<double> pose;  // X_BN
};

template <class S>
struct CompiledModel;

// Evaluations read the model from any number of threads; structure and parameters are edited by one thread while nobody evaluates.
class Multibody : public std::enable_shared_from_this<Multibody> {
 public:
  // keep_welds: a body on a weld stays a body with no coordinates; else it is lumped into the body that moves it and becomes a node.
  explicit Multibody(std::string name, bool keep_welds = false, bool strict = false);

  // ---- structure
  // `body.parent` is ignored; `parent` names a body, a node, or is empty for the base. Numbers are checked first: ModelError names body
  // and number and leaves the model as it was.
  void add_body(Body body, const std::string& parent);
  void remove_body(const std::string& name);  // with everything outboard of it
  void add_node(const std::string& name, const std::string& body, const Pose<double>& pose);

  const std::string& name() const { return name_; }
  bool keeps_welds() const { return keep_welds_; }
  bool strict() const { return strict_; }
  int bodies() const { return static_cast<int>(bodies_.size()); }
  const Body& body(int k) const { return settled().bodies_[k]; }
  const std::vector<Node>& nodes() const { return settled().nodes_; }
  int body_index(const std::string& name) const;   // ModelError with near names
  int hinge_index(const std::string& name) const;
  int node_index(const std::string& name) const;   // bodies count as nodes at their own frames
  // Nodes first, then the bodies' own frames.
  Node node(int index) const;
  int nq() const { return settled().q_offset_.back(); }
  int nv() const { return settled().v_offset_.back(); }
  int q_offset(int body) const { return settled().q_offset_[body]; }
  int v_offset(int body) const { return settled().v_offset_[body]; }
  SkoStructure structure() const;

  // ---- parameters: each change raises parameters()
  std::uint64_t parameters() const { return parameters_; }
  void set_mass_properties(int body, double mass, const Vector3<double>& com, const Symmetric3<double>& inertia);
  void set_placement(int body, const Pose<double>& placement);
  void set_rotor_inertia(int body, const std::vector<double>& values);  // one stands for all coordinates
  void set_limits(int body, const std::vector<double>& lower, const std::vector<double>& upper);  // empty: none
  Vector3<double> gravity() const { return gravity_; }
  void set_gravity(const Vector3<double>& g);
  bool has_rotor_inertia() const;

  // ---- state
  std::shared_ptr<const StateData> state() const;
  void set_q(const std::vector<double>& q);
  void set_v(const std::vector<double>& v);
  std::vector<double> zero_q() const;       // unit quaternions, zeros
  // Throws ModelError that names the hinge: wrong size, NaN, a quaternion of no length.
  void check_q(const double* q, size_t size) const;
  void check_v(const double* v, size_t size, const char* what) const;
  void integrate(const double* q, const double* dv, double* out) const;          // q moved by the velocity dv for unit time
  void difference(const double* q0, const double* q1, double* out) const;        // dv with integrate(q0, dv) = q1

  // ---- parts (part.h)
  // Some of the bodies of `whole`, by number, as a model of their own that follows its parameters and shares its state. An edit of a body here is
  // one there; an edit of the whole's structure makes the part stale (StaleOperatorError). ModelError where the bodies do not hang together.
  static std::shared_ptr<Multibody> part_of(const std::shared_ptr<Multibody>& whole, const std::string& name, std::vector<int> bodies, bool moving_base);
  const PartOf* part() const { return part_.get(); }  // null: no part
  // The state of a moving base is the carrier's again, after it was set here.
  void follow_base();

  // What is legal but worth a word, and of which body: triangle inequalities, massless bodies on hinges. Said once.
  std::vector<std::pair<std::string, std::string>> take_warnings();

  // ---- the numbers in flat arrays of one scalar, for kernels; rebuilt when parameters changed
  template <class S>
  std::shared_ptr<const CompiledModel<S>> compiled() const;

  // Between these, evaluations, nothing is edited: an edit raises ModelError. Evaluations of several threads and setting q and v are no edits.
  unsigned enter_use() const { return use_.enter(); }
  void leave_use(unsigned entered) const noexcept { use_.leave(entered); }

  // The operators made for this structure; told when it changes.
  std::shared_ptr<SkoSource> operators() const;
  void keep_operators(const std::shared_ptr<SkoSource>& source);

 private:
  friend struct StructureEdits;  // structure_edits.h: bodies on other hinges and parents, locked, coalesced, split
  // An edit in progress: nobody evaluates meanwhile, the model or a part of it. Throws where somebody does.
  class Edit {
   public:
    explicit Edit(Multibody& model);
    ~Edit() { end(); }
    Edit(const Edit&) = delete;

   private:
    void begin(Multibody& model);
    void end();
    std::vector<std::shared_ptr<Multibody>> parts_;
    std::vector<UseCount*> edited_;
  };
  void note(const std::string& body, const std::string& text);
  void check_coordinate_names(const Hinge& hinge) const;
  void check_new_name(const std::string& name, const char* what) const;
  Node find_frame(const std::string& name) const;   // a node, or a body's own frame
  void lump(const Body& body, const Node& onto);
  void structure_changed(const std::string& reason);
  // Of parts: what they are told, and what is theirs alone.
  void with_parts(std::vector<std::shared_ptr<Multibody>>& all) const;  // parts, and parts of parts
  template <class F>
  void for_each_part(F f) {
    for (const auto& known : parts_)
      if (const auto part = known.lock()) f(*part);
  }
  void body_changed(int k);
  void node_added(const Node& node);
  void gravity_changed(const Vector3<double>& g);
  void whole_changed(const std::string& reason);
  int number_in_whole(int k) const;
  void require_whole(const std::string& edit) const;
  std::shared_ptr<const StateData> state_of_part() const;
  void set_in_whole(const std::vector<double>& numbers, bool of_q);
  // Bodies are put in depth-first order, coordinates numbered and q, v carried over by hinge name: at the first look after an edit.
  const Multibody& settled() const {
    if (!settled_.load(std::memory_order_acquire)) settle_once();
    return *this;
  }
  void settle_once() const;
  void settle();

  std::string name_;
  bool keep_welds_, strict_;
  std::vector<Body> bodies_;
  std::vector<Node> nodes_;
  std::unordered_map<std::string, int> body_numbers_, hinge_numbers_, node_numbers_;
  std::vector<int> q_offset_, v_offset_;    // one longer than bodies
  std::vector<int> quaternions_;            // where in q they begin
  Vector3<double> gravity_{0, 0, 0};
  mutable std::shared_ptr<const StateData> state_;
  mutable Mutex mutex_;
  mutable UseCount use_;
  std::atomic<std::uint64_t> parameters_ = 1;  // read beside edits
  std::vector<std::pair<std::string, std::string>> warnings_;
  std::set<std::string> said_massless_;
  std::unordered_map<std::string, std::pair<std::vector<double>, std::vector<double>>> carried_;  // q, v by hinge, across an edit
  std::atomic<bool> settled_{true};
  std::weak_ptr<SkoSource> operators_;
  std::vector<std::weak_ptr<Multibody>> parts_;
  std::unique_ptr<const PartOf> part_;
  std::string stale_;                       // of a part: why it is none any more
  mutable std::shared_ptr<const StateData> whole_state_;  // of which, at that version, state_ was made
  mutable std::uint64_t whole_version_ = 0;
  std::uint64_t base_given_ = 0;            // grows with what is given to a moving base
  std::vector<double> base_q_, base_v_;     // given to it; empty: the carrier's
  template <class S>
  using CompiledPointer = std::shared_ptr<const CompiledModel<S>>;
  mutable PerScalar<CompiledPointer> compiled_;
};

// Recorded numbers of the model are constants: those of its doubles.
template <>
std::shared_ptr<const CompiledModel<Recorded>> Multibody::compiled<Recorded>() const;

// An evaluation: as long as it lives the model is not edited.
class ModelInUse {
 public:
  explicit ModelInUse(const Multibody& model) : model_(model), entered_(model.enter_use()) {}
  ~ModelInUse() { model_.leave_use(entered_); }
  ModelInUse(const ModelInUse&) = delete;

 private:
  const Multibody& model_;
  unsigned entered_;
};

}  // namespace pycraft
