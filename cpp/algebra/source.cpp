#include "algebra/source.h"

#include <algorithm>
#include <mutex>
#include <unordered_set>

#include "algebra/errors.h"
#include "algebra/values.h"

namespace pycraft {

namespace {

// Which sources are alive: a space may outlive the model it belongs to.
struct Alive {
  Mutex mutex;
  std::unordered_set<const void*> sources;
};
Alive& alive() {
  static Alive* const instance = new Alive;  // never destroyed: sources may go during the exit of the process
  return *instance;
}

}  // namespace

SkoSource::SkoSource(SkoStructure structure, std::string name) : structure_(std::move(structure)), name_(std::move(name)) {
  {
    std::lock_guard<Mutex> lock(alive().mutex);
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
  std::lock_guard<Mutex> lock(alive().mutex);
  alive().sources.erase(this);
}

std::shared_ptr<SkoSource> source_owning(const Space& space) {
  std::lock_guard<Mutex> lock(alive().mutex);
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

namespace {

// `kept` at this state: moved there where nobody reads it, else afresh; who still reads the old numbers keeps them.
template <class S>
void move_or_make(std::shared_ptr<SkoValues<S>>& kept, const SkoSource& source, Form form, const double* q, const double* v) {
  if (!kept || !kept->unused() || !kept->askable()) {
    kept = source.make_values(S());
    kept->use(form);
  }
  kept->move_to(q, v);
}

}  // namespace

template <class S>
ValuesInUse<S> SkoSource::current_values(unsigned groups) {
  check_current();
  ValueCache<S>& c = std::get<ValueCache<S>>(caches_);
  ValuesInUse<S> values;
  {
    std::lock_guard<Mutex> lock(c.mutex);
    if (c.mutex.abandoned()) leave_behind(c.values, c.state);
    const std::shared_ptr<const StateData> now = state();
    const std::uint64_t version = parameters();
    if (!c.values || c.state != now || c.parameters != version || !c.values->askable()) {
      c.state = nullptr;  // until the values are there
      move_or_make(c.values, *this, Form::fast, now->q.data(), now->v.data());
      c.state = now;
      c.parameters = version;
    }
    values = ValuesInUse<S>(c.values);
  }
  values->require(groups);
  return values;
}

#define PYCRAFT_INSTANTIATE(S) template ValuesInUse<S> SkoSource::current_values<S>(unsigned);
PYCRAFT_FOR_EACH_SCALAR(PYCRAFT_INSTANTIATE)
#undef PYCRAFT_INSTANTIATE

template <class S>
ValuesInUse<S> Binding::values(const std::shared_ptr<SkoSource>& source, unsigned groups) const {
  source->check_current();
  ValuesInUse<S> found;
  {
    std::lock_guard<Mutex> lock(mutex);
    auto& known = std::get<Entries<S>>(entries);
    if (mutex.abandoned()) leave_behind(known);
    auto entry = std::find_if(known.begin(), known.end(), [&](const Entry<S>& e) { return e.source.lock() == source; });
    if (entry == known.end()) entry = known.insert(known.end(), Entry<S>{source, 0, nullptr});
    if (!entry->values || entry->parameters != source->parameters() || !entry->values->askable()) {
      entry->parameters = 0;  // until the values are there; versions start at 1
      move_or_make(entry->values, *source, arithmetic.form, q.data(), v.data());
      entry->parameters = source->parameters();
    }
    found = ValuesInUse<S>(entry->values);
  }
  found->require(groups);
  return found;
}

#define PYCRAFT_INSTANTIATE(S) template ValuesInUse<S> Binding::values<S>(const std::shared_ptr<SkoSource>&, unsigned) const;
PYCRAFT_FOR_EACH_SCALAR(PYCRAFT_INSTANTIATE)
#undef PYCRAFT_INSTANTIATE

}  // namespace pycraft
