#include "kernels/recorded_columns.h"

#include <vector>

#define PYCRAFT_INSTRUCTION_SET recorded
#include "lanes/lanes.h"
#include "lanes/sine_cosine.h"

namespace pycraft::kernels::recorded {

template <>
struct BitsOf<Recorded> {
  using type = std::int64_t;  // what is asked of them is decided where it is asked
};
using Number = Lanes<Recorded, 1>;

// What decides nothing, said so.
inline Number larger(const Number& a, const Number& b) { return Number(maximum(a.v, b.v)); }
inline Number magnitude(const Number& a) { return Number(abs(a.v)); }
inline SineCosine<Number> sine_cosine(const Number& x) {
  const TurnSines<Recorded> of = turn_sines(x.v);
  return {Number(of.sine), Number(of.cosine)};
}

// Coordinates, known by their places: kernels read doubles.
struct Coordinates {
  std::vector<double> places;
  const Recorded* q;
};
inline thread_local const Coordinates* coordinates = nullptr;
template <>
inline Number gathered<Number>(const double* place, std::size_t, int) {
  return Number(coordinates->q[place - coordinates->places.data()]);
}

}  // namespace pycraft::kernels::recorded

#include "kernels/steps.h"

namespace pycraft::kernels::recorded {

// Of pins alone: what else turns takes its coordinates itself.
inline States<Recorded> with_turns(const Links<Recorded>& links, const States<Recorded>& at, Recorded* work) {
  Recorded* const cosines = work + padded(links);
  for (int k = 0; k < links.count; ++k) {
    const int q = links.link[k].q;
    if (links.link[k].step > Step::turned_pin) continue;
    const SineCosine<Number> of = sine_cosine(gathered<Number>(at.q + q, 0, 1));
    work[q] = of.sine.v, cosines[q] = of.cosine.v;
  }
  States<Recorded> turned = at;
  turned.sines = work, turned.cosines = cosines;
  return turned;
}

}  // namespace pycraft::kernels::recorded

#include "kernels/link_columns.h"
#include "kernels/mass_matrix_of_columns.h"

namespace pycraft::kernels {

namespace {

bool eliminate(const Links<Recorded>& links, const Recorded* q, void (*interrupt)(), Recorded* kept) {
  const recorded::Coordinates coordinates{std::vector<double>(links.nq + 1), q};
  struct Read {
    explicit Read(const recorded::Coordinates& of) { recorded::coordinates = &of; }
    ~Read() { recorded::coordinates = nullptr; }
  } read(coordinates);
  return recorded::eliminate_at(links, States<Recorded>{coordinates.places.data(), nullptr, nullptr, 0, 0, 0, 1, nullptr, nullptr, interrupt}, kept);
}

constexpr auto by_links = recorded::of_columns<recorded::InverseOfLinks, Recorded, 1, EliminatedLinks<Recorded>>;

}  // namespace

const ColumnKernels<Recorded> recorded_columns{
    recorded::of_columns<recorded::MassMatrixInverse, Recorded, 1>,
    {recorded::of_columns<recorded::MassMatrix<false>, Recorded, 1>, recorded::of_columns<recorded::MassMatrix<true>, Recorded, 1>},
    {recorded::kept_of_links<Recorded>, eliminate, by_links, by_links}};

}  // namespace pycraft::kernels
