#include "algebra/language/source.h"

#include <algorithm>
#include <cstring>
#include <mutex>
#include <unordered_map>
#include <unordered_set>

#include "algebra/language/values.h"
#include "numerics/recorded.h"
#include "runtime/errors.h"

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

void SkoSource::share_bodies_with(const SkoSource& other) {
  body_layout_ = other.body_layout_;
  theta_layout_ = cut_into_bodies_of(*theta_layout_, body_layout_->bodies);
}

void SkoSource::share_coordinates_in_groups(const SkoSource& other, const std::vector<std::vector<int>>& groups) {
  theta_layout_ = cut_into_groups(*other.theta_layout_, groups, this);
}

Space SkoSource::space(SpaceKind kind, const SymbolArguments&) const {
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

std::unique_ptr<SkoValues<Recorded>> SkoSource::make_values(Recorded) const { return nullptr; }

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

namespace {

// Bits, so that 0 and -0 are two states.
bool same_numbers(const std::vector<double>& a, const std::vector<double>& b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0);
}

bool alike(const Binding& a, const Binding& b) {
  return a.batch == b.batch && a.nq == b.nq && a.nv == b.nv && a.arithmetic == b.arithmetic && a.threads == b.threads && same_numbers(a.q, b.q) && same_numbers(a.v, b.v);
}

size_t hash_of(const Binding& b) {
  size_t h = static_cast<size_t>(b.batch) * 31 + static_cast<size_t>(b.arithmetic.precision) * 7 + static_cast<size_t>(b.arithmetic.form);
  for (const std::vector<double>* numbers : {&b.q, &b.v})
    for (double x : *numbers) {
      std::uint64_t bits;
      std::memcpy(&bits, &x, sizeof bits);
      h = (h ^ bits) * 0x9e3779b97f4a7c15ULL;
      h ^= h >> 32;
    }
  return h;
}

struct KnownBindings {
  Mutex mutex;
  std::unordered_multimap<size_t, std::weak_ptr<const Binding>> all;
  size_t swept_at = 64;  // how many there are when those that are gone are taken out
};
KnownBindings& known_bindings() {
  static KnownBindings* const instance = new KnownBindings;  // never destroyed: bindings may go during the exit of the process
  return *instance;
}

}  // namespace

std::shared_ptr<const Binding> the_one_like(std::shared_ptr<const Binding> made) {
  const size_t key = hash_of(*made);
  KnownBindings& known = known_bindings();
  std::lock_guard<Mutex> lock(known.mutex);
  if (known.mutex.abandoned()) leave_behind(known.all);
  const auto [first, last] = known.all.equal_range(key);
  for (auto i = first; i != last; ++i)
    if (auto found = i->second.lock(); found && alike(*found, *made)) return found;
  if (known.all.size() >= known.swept_at) {
    std::erase_if(known.all, [](const auto& entry) { return entry.second.expired(); });
    known.swept_at = 2 * known.all.size() + 64;
  }
  known.all.emplace(key, made);
  return made;
}

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
