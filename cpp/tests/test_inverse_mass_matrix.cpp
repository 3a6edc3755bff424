// The inverse of the mass matrix by innovations, against the dense inverse of the mass matrix by composite bodies, on random trees.
#define BOOST_TEST_MODULE inverse_mass_matrix
#include <boost/test/included/unit_test.hpp>

#include <Eigen/Dense>
#include <limits>
#include <random>

#include "algebra/trees/sweeps/articulated_inertia.h"
#include "model/compiled_model.h"
#include "model/multibody.h"
#include "recursions/composite_mass_matrix.h"
#include "recursions/inverse_mass_matrix.h"
#include "recursions/kinematics.h"
#include "robot.h"

using namespace pycraft;
using pycraft::testing::random_numbers;

namespace {

using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using Kinds = std::vector<SubhingeKind>;

constexpr SubhingeKind pin = SubhingeKind::pin, slider = SubhingeKind::slider, screw = SubhingeKind::screw, ball = SubhingeKind::ball,
                       free_ = SubhingeKind::free;

Body random_body(int k, const Kinds& kinds, std::mt19937& random) {
  const std::vector<double> x = random_numbers(20 + 6 * static_cast<int>(kinds.size()), static_cast<int>(random()));
  Body b;
  b.name = "body" + std::to_string(k);
  b.mass = 2 + x[0];
  b.com = {x[1], x[2], x[3]};
  b.inertia = {1 + 0.2 * x[4], 0.1 * x[5], 0.1 * x[6], 1 + 0.2 * x[7], 0.1 * x[8], 1 + 0.2 * x[9]};
  b.hinge.name = "hinge" + std::to_string(k);
  b.hinge.kind = kinds.empty() ? HingeKind::weld : HingeKind::custom;
  b.hinge.placement = {exp_rotation(Vector3<double>{x[10], x[11], x[12]}), {x[13], x[14], x[15]}};
  for (size_t i = 0; i < kinds.size(); ++i) {
    const double* const y = x.data() + 20 + 6 * i;
    const bool turns = kinds[i] != slider && kinds[i] != free_;
    b.hinge.subhinges.push_back(subhinge_of(kinds[i], {y[0], y[1], 1 + y[2]}, turns ? Vector3<double>{y[3], y[4], y[5]} : Vector3<double>::zero(),
                                            kinds[i] == screw ? 0.3 : 0, b.hinge.name));
  }
  // More than six coordinates of one hinge have an inverse through their rotors alone.
  if (b.hinge.nv() > 6) b.hinge.rotor_inertia.assign(b.hinge.nv(), 0.5);
  return b;
}

// Body k on the hinge hinges[k] to body parents[k].
std::shared_ptr<Multibody> random_robot(const std::vector<int>& parents, const std::vector<Kinds>& hinges, std::mt19937& random) {
  auto model = std::make_shared<Multibody>("random", true);
  for (size_t k = 0; k < parents.size(); ++k)
    model->add_body(random_body(static_cast<int>(k), hinges[k], random), parents[k] < 0 ? "" : "body" + std::to_string(parents[k]));
  return model;
}

struct Both {
  Matrix inverse, mass_matrix;
};

// One workspace serves every call: what a model before has left in it does no harm.
Both both(const Multibody& model, Form form, std::mt19937& random, InverseColumns<double>& workspace) {
  const auto compiled = model.compiled<double>();
  const SkoStructure tree = model.structure();
  const int N = model.nv();
  std::vector<double> q = model.zero_q();
  model.integrate(q.data(), random_numbers(N, static_cast<int>(random())).data(), q.data());
  RigidBlocks<double> blocks(tree);
  blocks.form = form;
  kinematics(*compiled, q.data(), blocks);
  const double unset = std::numeric_limits<double>::quiet_NaN();
  Both found{Matrix::Constant(N, N, unset), Matrix::Constant(N, N, unset)};
  composite_mass_matrix(tree, *compiled, blocks, found.mass_matrix.data());
  articulated_inertia_tip_to_base(tree, blocks);
  inverse_mass_matrix(tree, *compiled, blocks, workspace, found.inverse.data());
  return found;
}

void check_inverse(const Multibody& model, std::mt19937& random, InverseColumns<double>& workspace) {
  for (const Form form : {Form::fast, Form::ud, Form::square_root}) {
    const auto [inverse, M] = both(model, form, random, workspace);
    for (int i = 0; i < M.rows(); ++i)
      for (int j = 0; j < i; ++j) BOOST_TEST(inverse(i, j) == inverse(j, i));
    const Eigen::SelfAdjointEigenSolver<Matrix> spectrum(M);
    const double smallest = spectrum.eigenvalues().minCoeff(), condition = spectrum.eigenvalues().maxCoeff() / smallest;
    // An entry of M, a pivot and a column are sums over six numbers a body; each route moves M by no more than the rounding of those,
    // and its inverse, 1/smallest in size, by that times the condition.
    const double rounding = 6 * model.bodies() * std::numeric_limits<double>::epsilon(), bound = 2 * rounding * condition / smallest;
    const Matrix dense = M.fullPivLu().inverse();
    BOOST_TEST((inverse - dense).cwiseAbs().maxCoeff() <= bound);
    BOOST_TEST(bound < 1e-6 / smallest);  // else it would say nothing
  }
}

}  // namespace

BOOST_AUTO_TEST_CASE(one_body) {
  std::mt19937 random(1);
  InverseColumns<double> workspace;
  for (const Kinds& hinge : {Kinds{pin}, Kinds{slider}, Kinds{ball}, Kinds{free_}, Kinds{slider, free_, pin}})
    for (int trial = 0; trial < 5; ++trial) check_inverse(*random_robot({-1}, {hinge}, random), random, workspace);
}

BOOST_AUTO_TEST_CASE(no_coordinates) {
  std::mt19937 random(2);
  InverseColumns<double> workspace;
  BOOST_TEST(both(*random_robot({-1, 0}, {{}, {}}, random), Form::fast, random, workspace).inverse.size() == 0);
}

BOOST_AUTO_TEST_CASE(chains_stars_and_branches) {
  std::mt19937 random(3);
  InverseColumns<double> workspace;
  const std::vector<std::vector<int>> trees = {
      {-1, 0, 1, 2, 3, 4}, {-1, 0, 0, 0, 0}, {-1, 0, 1, 1, 0, 4, 4}, {-1, 0, 1, 2, 0, 4, 4, 6}, {-1, -1, 0, 1, -1}};
  for (const std::vector<int>& parents : trees)
    for (const Kinds& hinge : {Kinds{pin}, Kinds{screw, slider}})
      check_inverse(*random_robot(parents, std::vector<Kinds>(parents.size(), hinge), random), random, workspace);
}

BOOST_AUTO_TEST_CASE(wide_hinges_at_every_place) {
  std::mt19937 random(4);
  InverseColumns<double> workspace;
  const std::vector<int> parents = {-1, 0, 1, 1, 0};
  for (const Kinds& wide : {Kinds{free_}, Kinds{slider, free_, pin}, Kinds{}})
    for (size_t at = 0; at < parents.size(); ++at) {
      std::vector<Kinds> hinges(parents.size(), Kinds{pin});
      hinges[at] = wide;
      check_inverse(*random_robot(parents, hinges, random), random, workspace);
    }
}

// More columns than a tile of the copy, and bodies that take their turn after long branches.
BOOST_AUTO_TEST_CASE(random_trees) {
  std::mt19937 random(5);
  InverseColumns<double> workspace;
  const std::vector<Kinds> all = {{pin}, {slider}, {screw}, {ball}, {pin, slider}, {free_}, {slider, free_, pin}, {}};
  for (int trial = 0; trial < 20; ++trial) {
    std::vector<int> parents = {-1};
    std::vector<Kinds> hinges = {{free_}};
    const int bodies = 2 + static_cast<int>(random() % 40);
    while (static_cast<int>(parents.size()) < bodies) {
      parents.push_back(static_cast<int>(random() % (parents.size() + 1)) - 1);
      hinges.push_back(all[random() % all.size()]);
    }
    check_inverse(*random_robot(parents, hinges, random), random, workspace);
  }
}
