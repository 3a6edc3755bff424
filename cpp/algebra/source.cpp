#include "algebra/source.h"

#include <unordered_set>

#include "algebra/errors.h"
#include "algebra/values.h"

namespace pycraft {

namespace {

// Which sources are alive: a space may outlive the model it belongs to.
struct Alive {
  std::mutex mutex;
  std::unordered_set<const void*> sources;
};
Alive& alive() {
  static Alive* const instance = new Alive;  // never destroyed: sources may go during the exit of the process
  return *instance;
}

}  // namespace

SkoSource::SkoSource(SkoStructure structure, std::string name) : structure_(std::move(structure)), name_(std::move(name)) {
  {
    std::lock_guard<std::mutex> lock(alive().mutex);
    alive().sources.insert(this);
  }
  theta_layout_ = coordinate_layout(structure_, this, name_);
  body_layout_ = body_layout(structure_, this, name_);
}

Space SkoSource::space(SpaceKind kind, const std::vector<int>&) const {
  switch (kind) {
    case SpaceKind::Theta: return theta();
    case SpaceKind::V: return motions();
    case SpaceKind::F: return forces();
    case SpaceKind::Euclidean: return Space::euclidean(1);
    default: throw EvaluationError("'" + name_ + "' has no nodes");
  }
}

SkoSource::~SkoSource() {
  std::lock_guard<std::mutex> lock(alive().mutex);
  alive().sources.erase(this);
}

std::shared_ptr<SkoSource> source_owning(const Space& space) {
  std::lock_guard<std::mutex> lock(alive().mutex);
  if (!space || !alive().sources.count(space.layout().owner)) return nullptr;
  return const_cast<SkoSource*>(static_cast<const SkoSource*>(space.layout().owner))->weak_from_this().lock();
}

void SkoSource::invalidate(const std::string& reason) {
  stale_reason_ = reason;
  stale_.store(true);
}

void SkoSource::check_current() const {
  if (stale_.load())
    throw StaleOperatorError("this operator was made before '" + name_ + "' changed (" + stale_reason_ + "); take it anew from the model's soa");
}

template <class S>
std::shared_ptr<SkoValues<S>> SkoSource::current_values(unsigned groups) {
  check_current();
  ValueCache<S>& c = std::get<ValueCache<S>>(caches_);
  std::shared_ptr<SkoValues<S>> values;
  {
    std::lock_guard<std::mutex> lock(c.mutex);
    const std::shared_ptr<const StateData> now = state();
    const std::uint64_t version = parameters();
    if (!c.values || c.state != now || c.parameters != version) {
      // Somebody may still be reading the old numbers: they keep them, we start afresh.
      if (!c.values || c.values.use_count() > 1) c.values = make_values(S());
      c.values->move_to(now->q.data(), now->v.data());
      c.state = now;
      c.parameters = version;
    }
    values = c.values;
  }
  values->require(groups);
  return values;
}

#define PYCRAFT_INSTANTIATE(S) template std::shared_ptr<SkoValues<S>> SkoSource::current_values<S>(unsigned);
PYCRAFT_FOR_EACH_SCALAR(PYCRAFT_INSTANTIATE)
#undef PYCRAFT_INSTANTIATE

template <class S>
std::shared_ptr<SkoValues<S>> Binding::values(const std::shared_ptr<SkoSource>& source, unsigned groups) const {
  source->check_current();
  std::shared_ptr<SkoValues<S>> found;
  {
    std::lock_guard<std::mutex> lock(mutex);
    auto& known = std::get<std::vector<Entry<S>>>(entries);
    for (Entry<S>& e : known)
      if (e.source.lock() == source) {
        if (e.parameters != source->parameters()) {
          if (e.values.use_count() > 1) {
            e.values = source->make_values(S());
            e.values->use(arithmetic.form);
          }
          e.values->move_to(q.data(), v.data());
          e.parameters = source->parameters();
        }
        found = e.values;
      }
    if (!found) {
      found = source->make_values(S());
      found->use(arithmetic.form);
      found->move_to(q.data(), v.data());
      known.push_back({source, source->parameters(), found});
    }
  }
  found->require(groups);
  return found;
}

#define PYCRAFT_INSTANTIATE(S) template std::shared_ptr<SkoValues<S>> Binding::values<S>(const std::shared_ptr<SkoSource>&, unsigned) const;
PYCRAFT_FOR_EACH_SCALAR(PYCRAFT_INSTANTIATE)
#undef PYCRAFT_INSTANTIATE

}  // namespace pycraft
