// The overloaded arithmetic as a C++ program uses it: the book's formulas, typed literally.
#define BOOST_TEST_MODULE arithmetic
#include <boost/test/included/unit_test.hpp>

#include "algebra/engine/eigen.h"
#include "random_tree.h"
#include "runtime/errors.h"

using namespace pycraft;

BOOST_AUTO_TEST_CASE(the_books_formulas) {
  const Letters o(testing::random_tree(1, {-1, 0, 1, 1, 0}));
  const auto& [_, E, phi, phi_tilde, H, M, J, P, P_plus, D, G, K, tau, tau_bar, E_psi, psi, psi_tilde, R, Upsilon, Omega, I] = o;
  const Expression MM = H * phi * M * phi.T() * H.T();
  const Expression S = I - H * psi * K;
  const int n = MM.domain().dimension();
  const Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(n, 1, 2);
  const DenseMatrix A = dense(MM);
  const double bound = 1e-13 * A.norm() * A.inverse().norm();
  BOOST_TEST((MM * x - A * x).norm() < bound * (A * x).norm());
  BOOST_TEST((MM.inv() * x - A.ldlt().solve(x)).norm() < bound * x.norm());
  BOOST_TEST(((S.T() * D.inv() * S) * x - A.ldlt().solve(x)).norm() < bound * x.norm());
  BOOST_TEST((power(MM, -1) * x - MM.inv() * x).norm() == 0.0);
  BOOST_TEST(((MM / 2 - 0.5 * MM + MM * 3) * x - 3 * (A * x)).norm() < bound * (A * x).norm() * 10);
  BOOST_TEST((-(-MM) * x - MM * x).norm() == 0.0);
  const DenseMatrix X = DenseMatrix::Random(3, n);
  BOOST_TEST((X * MM - X * A).norm() < bound * A.norm());
  BOOST_TEST((dense(I * MM) - A).norm() == 0.0);
  BOOST_TEST((zero(MM.domain(), MM.codomain()) * x).norm() == 0.0);
  BOOST_TEST(std::abs(value(logdet(MM)) - std::log(A.determinant())) < 1e-11);
  BOOST_TEST(std::abs(value(trace(MM) + 2.0 * logdet(I + H * phi * K)) - A.trace()) < bound * A.trace());
  BOOST_TEST(std::abs(value(norm(MM)) - A.norm()) < bound * A.norm());
  BOOST_CHECK_THROW(H * x, SpaceError);
  BOOST_CHECK_THROW(M * phi, SpaceError);
}
