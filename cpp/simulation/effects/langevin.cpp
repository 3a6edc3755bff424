#include "simulation/effects/langevin.h"

#include <boost/random/normal_distribution.hpp>
#include <boost/random/splitmix64.hpp>
#include <cmath>

namespace pycraft {

namespace {

// Each number is the seed of a generator that gives the next.
double unit_normal(std::uint64_t seed, std::uint64_t impulse, std::uint64_t coordinate) {
  for (const std::uint64_t number : {impulse, coordinate}) seed = boost::random::splitmix64(seed)() ^ number;
  boost::random::splitmix64 generator(seed);
  return boost::random::normal_distribution<double>()(generator);
}

template <class S>
class BoundLangevin : public BoundEffect<S> {
 public:
  explicit BoundLangevin(const Langevin& of) : coordinates_(of.coordinates), seed_(of.seed) {
    using std::sqrt;
    for (const double c : of.friction) brake_.push_back(S(of.period) * S(c)), noise_.push_back(sqrt(S(2) * S(of.kT) * brake_.back()));
  }
  void impulses(const At<S>& at, std::uint64_t number, S* out) override {
    for (size_t i = 0; i < coordinates_.size(); ++i) {
      const int j = coordinates_[i];
      out[j] += noise_[i] * S(unit_normal(seed_, number, static_cast<std::uint64_t>(j))) - brake_[i] * at.v[j];
    }
  }

 private:
  std::vector<int> coordinates_;
  std::uint64_t seed_;
  std::vector<S> brake_, noise_;  // hΓ, √(2kT hΓ)
};

}  // namespace

Langevin::Langevin(const Multibody& model, const Names& hinges, double energy, const std::vector<double>& given, double between, std::uint64_t from)
    : coordinates(coordinates_named(model, hinges, "langevin")), friction(not_negative(given, coordinates.size(), "langevin: friction")), kT(energy), period(between), seed(from) {}

Declaration Langevin::declaration() const {
  Declaration d;
  d.work = true;
  d.impulse_period = period;
  for (size_t i = 0; i < coordinates.size(); ++i) d.resists.push_back({.coordinate = coordinates[i], .damping = period * friction[i] / 2});
  return d;
}

PYCRAFT_BIND_EFFECT(Langevin, BoundLangevin)

}  // namespace pycraft
