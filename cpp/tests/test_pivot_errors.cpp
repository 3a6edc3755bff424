// Which states kernels of articulated inertias call sound: none that the general recursions refuse, and those of long chains.
#define BOOST_TEST_MODULE pivot_errors
#include <boost/test/included/unit_test.hpp>

#include <Eigen/Dense>
#include <cmath>
#include <optional>

#define PYCRAFT_INSTRUCTION_SET tested
#include "dynamics/rigid_dynamics.h"
#include "kernels/forward_dynamics.h"
#include "kernels/mass_matrix_of_links.h"
#include "kernels/instruction_set.h"
#include "kernels/link_model.h"
#include "robot.h"
#include "uneven.h"
#include "runtime/interrupt.h"

using namespace pycraft;
using pycraft::testing::random_numbers;
using pycraft::testing::uneven;

namespace {

struct States {
  std::vector<double> q, v, tau;
};

// Forward dynamics of all states by a kernel, and which of them it calls sound.
template <class T>
std::vector<bool> by_kernel(const kernels::Kernels<T>& kernel, const Multibody& model, const States& s, std::vector<double>& out) {
  const auto links = kernels::LinkModel<T>::of(model);
  BOOST_REQUIRE(links);
  const kernels::Kernel<T>& how = kernel[kernels::Call::forward_dynamics];
  const int nq = model.nq(), nv = model.nv(), count = static_cast<int>(s.q.size()) / nq;
  const size_t numbers = how.work(links->links(), 0);
  std::unique_ptr<T, void (*)(T*)> work(static_cast<T*>(::operator new(numbers * sizeof(T), std::align_val_t(64))), [](T* x) { ::operator delete(x, std::align_val_t(64)); });
  T gravity[3];
  for (int i = 0; i < 3; ++i) gravity[i] = static_cast<T>(to_double(model.gravity()[i]));
  std::vector<bool> sound;
  out.assign(size_t(count) * nv, 0.0);
  for (int b = 0; b < count; b += kernel.lanes) {
    const int lanes = std::min(kernel.lanes, count - b);
    const kernels::States<T> at{&s.q[size_t(b) * nq], &s.v[size_t(b) * nv], &s.tau[size_t(b) * nv], size_t(nq), size_t(nv), size_t(nv), lanes, gravity, nullptr, check_interrupt};
    const unsigned mask = how.run(links->links(), at, &out[size_t(b) * nv], nv, work.get());
    for (int i = 0; i < lanes; ++i) sound.push_back(mask >> i & 1);
  }
  return sound;
}

// Which of as many states as S has lanes stand out by their errors, whatever the estimate says. tell(links, work): at the end.
struct TellsNothing {
  template <class... All>
  void operator()(const All&...) const {}
};
template <class S, class Tell = TellsNothing>
unsigned by_errors(const Multibody& model, const States& s, int first, Tell tell = {}) {
  namespace k = kernels::tested;
  const auto model_links = kernels::LinkModel<double>::of(model);
  BOOST_REQUIRE(model_links);
  const kernels::Links<double>& links = model_links->links();
  const size_t bytes = k::ForwardWork<S>::size(links);
  std::unique_ptr<double, void (*)(double*)> work(static_cast<double*>(::operator new(bytes, std::align_val_t(64))), [](double* x) { ::operator delete(x, std::align_val_t(64)); });
  const k::ForwardWork<S> w(links, work.get());
  const int nq = model.nq();
  const double none[3] = {0, 0, 0};
  kernels::States<double> at{&s.q[size_t(first) * nq], nullptr, nullptr, size_t(nq), 0, 0, S::width, none, nullptr, check_interrupt};
  std::vector<double> turns(S::width == 1 ? k::turns_size(links) : 0);
  if (S::width == 1) at = k::with_turns(links, at, turns.data());
  for (int i = 0; i < links.count; ++i)
    k::with_step(links.link[i].step, [&](auto kind) { k::place_link<decltype(kind)>(links.link[i], at, w.link[i].motion.place); });
  k::articulated_tip_to_base<false>(links, at, w);
  std::vector<k::Inertia<S>> X(links.count);
  k::clear_branches(links, w, 0, links.count);
  const unsigned sound = S::mask(k::pivots_stand_out(links, at, w, k::travel<S>(links, at), 0, links.count, false, [&](int i, const k::Inertia<S>& of) { X[i] = of; }));
  tell(links, w, X);
  return sound;
}

std::optional<std::vector<double>> by_recursion(const Multibody& model, const States& s, int b) {
  RigidDynamics<double> general(model);
  std::vector<double> vdot(model.nv());
  try {
    general.forward_dynamics(&s.q[size_t(b) * model.nq()], &s.v[size_t(b) * model.nv()], &s.tau[size_t(b) * model.nv()], vdot.data());
  } catch (const SingularHingeError&) {
    return std::nullopt;
  }
  return vdot;
}

double length(const double* x, int n) {
  double sum = 0;
  for (int i = 0; i < n; ++i) sum += x[i] * x[i];
  return std::sqrt(sum);
}

// A chain of links of a meter and a kilogram, pins about x, y and z in turn; `kind` takes the place of every third.
std::shared_ptr<Multibody> chain(int n, HingeKind kind = HingeKind::pin) {
  auto mb = std::make_shared<Multibody>("chain");
  for (int k = 0; k < n; ++k) {
    Body b;
    b.name = "body" + std::to_string(k);
    b.mass = 1;
    b.com = {0.5, 0, 0};
    b.inertia = {0.01, 0, 0, 0.1, 0, 0.1};
    b.hinge.kind = k % 3 == 1 ? kind : HingeKind::pin;
    b.hinge.name = "hinge" + std::to_string(k);
    if (k > 0) b.hinge.placement.p = {1, 0, 0};
    std::vector<Vector3<double>> axes;
    if (b.hinge.kind != HingeKind::ball && b.hinge.kind != HingeKind::free) axes = {k % 2 ? Vector3<double>{0, 0, 1} : Vector3<double>{0, 1, 0}};
    if (kind == HingeKind::weld && k % 3 == 1) b.hinge.kind = HingeKind::pin, axes = {{0.6, 0, 0.8}};  // an oblique pin
    b.hinge.subhinges = subhinges_of(b.hinge.kind, axes, {0, 0, 0}, b.hinge.kind == HingeKind::screw ? 0.1 : 0, b.hinge.name);
    mb->add_body(b, k == 0 ? "" : "body" + std::to_string(k - 1));
  }
  mb->set_gravity({0, 0, -9.81});
  return mb;
}

States states_of(const Multibody& model, int count, int seed) {
  States s{random_numbers(count * model.nq(), seed), random_numbers(count * model.nv(), seed + 1), random_numbers(count * model.nv(), seed + 2)};
  return s;
}

}  // namespace

// The estimate by composite inertias, which grow as the cube of the length, leaves all of these in doubt.
BOOST_AUTO_TEST_CASE(long_chains_are_sound) {
  for (const HingeKind kind : {HingeKind::pin, HingeKind::weld, HingeKind::slider, HingeKind::screw, HingeKind::ball}) {
    const auto model = chain(4000, kind);
    const States s = states_of(*model, 1, 3);
    const std::vector<double> expected = by_recursion(*model, s, 0).value();
    std::vector<double> found;
    for (const auto& set : kernels::instruction_sets()) {
      BOOST_TEST(by_kernel(set.one, *model, s, found)[0], model->bodies() << " bodies with hinges of sort " << static_cast<int>(kind));
      for (size_t i = 0; i < found.size(); ++i) found[i] -= expected[i];
      BOOST_TEST(length(found.data(), model->nv()) < 1e-6 * length(expected.data(), model->nv()));
    }
  }
}

BOOST_AUTO_TEST_CASE(chains_in_single_precision_are_sound) {
  const auto model = chain(150);
  const int nv = model->nv();
  const States s = states_of(*model, 16, 5);
  std::vector<double> found;
  for (const auto& set : kernels::instruction_sets()) {
    const std::vector<bool> sound = by_kernel(set.singles, *model, s, found);
    for (int b = 0; b < 16; ++b) {
      BOOST_TEST(sound[b]);
      const std::vector<double> expected = by_recursion(*model, s, b).value();
      for (int i = 0; i < nv; ++i) found[size_t(b) * nv + i] -= expected[i];
      BOOST_TEST(length(&found[size_t(b) * nv], nv) < 0.01 * length(expected.data(), nv));
    }
  }
}

// X by the recursion of singular_pivot.h with matrices.
using Six = Eigen::Matrix<double, 6, 6>;
using One = kernels::tested::Lanes<double, 1>;

template <class Kind>
Matrix3<One> turned(const kernels::tested::Place<One>& place) {
  Matrix3<One> R;
  for (int c = 0; c < 3; ++c) {
    Vector3<One> unit{One(c == 0), One(c == 1), One(c == 2)};
    unit = Kind::rotation(place).to_parent(unit);
    for (int r = 0; r < 3; ++r) R(r, c) = unit[r];
  }
  return R;
}
Six force_to_parent(const Matrix3<One>& R, const Vector3<One>& p) {
  Eigen::Matrix3d turn, arm;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) turn(i, j) = R(i, j).v;
  arm << 0, -p[2].v, p[1].v, p[2].v, 0, -p[0].v, -p[1].v, p[0].v, 0;
  Six E = Six::Zero();
  E.topLeftCorner<3, 3>() = E.bottomRightCorner<3, 3>() = turn;
  E.topRightCorner<3, 3>() = arm * turn;
  return E;
}

BOOST_AUTO_TEST_CASE(errors_are_those_of_matrices) {
  namespace k = kernels::tested;
  for (int seed = 0; seed < 60; ++seed) {
    const auto model = uneven(seed, 0.1);
    by_errors<One>(*model, states_of(*model, 1, seed), 0, [&](const kernels::Links<double>& links, const k::ForwardWork<One>& w, const std::vector<k::Inertia<One>>& found) {
      std::vector<Six> P(links.count, Six::Zero()), X(links.count, Six::Zero());
      for (int i = links.count - 1; i >= 0; --i) {
        const kernels::Link<double>& link = links.link[i];
        const auto& m = link.moment;
        Six M = Six::Zero();
        M.diagonal() << link.rotational[0], link.rotational[3], link.rotational[5], link.mass, link.mass, link.mass;
        M(0, 1) = M(1, 0) = link.rotational[1], M(0, 2) = M(2, 0) = link.rotational[2], M(1, 2) = M(2, 1) = link.rotational[4];
        Eigen::Matrix3d about;
        about << 0, -m[2], m[1], m[2], 0, -m[0], -m[1], m[0], 0;
        M.topRightCorner<3, 3>() = about, M.bottomLeftCorner<3, 3>() = about.transpose();
        P[i] += M;
        const Six own = P[i].diagonal().asDiagonal();
        X[i] += own;
        k::with_step(link.step, [&](auto kind) {
          using Kind = decltype(kind);
          Six of = Six::Zero();
          for (int r = 0; r < 3; ++r)
            for (int c = 0; c < 3; ++c) of(r, c) = found[i].A(r, c).v, of(3 + r, 3 + c) = found[i].C(r, c).v, of(r, 3 + c) = of(3 + c, r) = found[i].B(r, c).v;
          BOOST_TEST((of - X[i]).norm() <= 1e-7 * X[i].norm(), "seed " << seed << ", link " << i);
          Eigen::Matrix<double, Kind::nv, 6> H;
          for (int r = 0; r < Kind::nv; ++r) {
            const auto row = k::own_row<Kind, One>(link, r);
            for (int c = 0; c < 3; ++c) H(r, c) = row.angular[c].v, H(r, 3 + c) = row.linear[c].v;
          }
          Eigen::Matrix<double, Kind::nv, Kind::nv> J = link.J * Eigen::Matrix<double, Kind::nv, Kind::nv>::Identity();
          const auto D = (H * P[i] * H.transpose() + J).eval();
          const auto G = (P[i] * H.transpose() * D.inverse()).eval();
          Eigen::Matrix<double, Kind::nv, 1> y = (H * own * H.transpose() + J).diagonal();
          if (link.oblique && Kind::nv == 1) y(0) = link.turn * link.turn * own.diagonal().head<3>().mean() + link.travel * link.travel * own.diagonal().tail<3>().mean() + link.J;
          if (link.parent < 0) return;
          const Six through = Six::Identity() - G * H, E = force_to_parent(turned<Kind>(w.link[i].motion.place), Kind::arm(link, w.link[i].motion.place));
          P[link.parent] += E * (P[i] - G * D * G.transpose()) * E.transpose();
          X[link.parent] += E * (own + through * X[i] * through.transpose() + G * y.asDiagonal() * G.transpose()) * E.transpose();
        });
      }
    });
  }
}

// Thresholds: twice the bound of rounding, and the faintest pivot; of several coordinates by their reach.
BOOST_AUTO_TEST_CASE(where_a_pivot_stands_out) {
  namespace k = kernels::tested;
  kernels::Links<double> links{};
  links.plain.rounding = 0x1p-20, links.plain.faint = 0x1p-10;
  const auto out = [&](double pivot, double error, double felt) { return One::mask(k::stands_out(links, One(1 / pivot), One(error), One(felt))); };
  BOOST_TEST(out(1, 0x1.fp18, 0));
  BOOST_TEST(!out(1, 0x1p19, 0));
  BOOST_TEST(out(1, 0, 0x1.fp9));
  BOOST_TEST(!out(1, 0, 0x1p10));
  BOOST_TEST(!out(-1, 0, 0));
  BOOST_TEST(!out(std::nan(""), 0, 0));
  k::Factors<3, One> factors;
  const double L[9] = {1, 0, 0, 0.5, 1, 0, -1.5, 0.25, 1}, squares[3] = {3, 5, 7};
  double work[3];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < i; ++j) factors.lower[i][j] = L[3 * i + j];
  for (int weak = 0; weak < 3; ++weak)
    for (const double by : {0.9, 1.1}) {
      for (int j = 0; j < 3; ++j) factors.inverse[j] = 1e-3 / (2 * links.plain.rounding * pivot_reach(L, 3, j, squares, work));
      factors.inverse[weak] *= One(1e3 * by);
      const One errors[3] = {3, 5, 7}, none[3] = {0, 0, 0};
      BOOST_TEST(One::mask(k::stand_out(links, factors, errors, none)) == (by < 1));
      const One scale(2 * links.plain.rounding / links.plain.faint), felt[3] = {scale * errors[0], scale * errors[1], scale * errors[2]};
      BOOST_TEST(One::mask(k::stand_out(links, factors, none, felt)) == (by < 1));
    }
}

// What the general recursions refuse does not stand out; nearly all of what they do not refuse does.
BOOST_AUTO_TEST_CASE(what_is_refused_does_not_stand_out) {
  int stand_out = 0, given = 0, refused = 0;
  for (int seed = 0; seed < 600; ++seed) {
    const auto model = uneven(seed);
    const States s = states_of(*model, 4, 1000 + seed);
    const unsigned packs = by_errors<kernels::tested::Lanes<double, 4>>(*model, s, 0);
    for (int b = 0; b < 4; ++b) {
      const bool gives = by_recursion(*model, s, b).has_value();
      (gives ? given : refused) += 1;
      const bool one = by_errors<kernels::tested::Lanes<double, 1>>(*model, s, b);
      BOOST_TEST(one == bool(packs >> b & 1), "seed " << seed << ", state " << b);
      if (!one) continue;
      ++stand_out;
      BOOST_TEST(gives, "seed " << seed << ", state " << b);
    }
  }
  BOOST_TEST_MESSAGE(stand_out << " of " << given << " stand out, " << refused << " are refused");
  BOOST_TEST(refused > 200);
  BOOST_TEST(stand_out > 2 * given / 3);
}
