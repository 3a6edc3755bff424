// Laws of rotations, poses and inertias, for every scalar, at ordinary and at degenerate points.
#define BOOST_TEST_MODULE spatial
#include <boost/test/included/unit_test.hpp>
#include <random>

#include "numerics/scalar.h"
#include "spatial/symmetric6.h"

using namespace pycraft;
using Scalars = std::tuple<Single, double, Extended, Quad, Digits50, Digits100>;

namespace {

template <class S>
struct Draw {
  std::mt19937 g{7};
  S number(double scale = 1) { return S(scale * std::normal_distribution<double>()(g)); }
  Vector3<S> vector(double scale = 1) { return {number(scale), number(scale), number(scale)}; }
  Pose<S> pose() { return exp_pose(Vector6<S>{vector(), vector()}); }
  RigidInertia<S> inertia() {
    Symmetric3<S> I = point_inertia(vector());
    for (int i : {0, 3, 5}) I.s[i] += S(1);
    return rigid_inertia(S(1.5), vector(0.3), I);
  }
  Vector6<S> six() { return {vector(), vector()}; }
};

template <class S>
double relative(const S& a, const S& b) {
  using std::abs;
  return to_double(S(abs(a - b) / (S(1) + abs(a) + abs(b)) / epsilon<S>()));
}

// Largest difference of two vectors in units of epsilon, relative to their size.
template <class S>
double relative(const Vector6<S>& a, const Vector6<S>& b) {
  double worst = 0;
  for (int i = 0; i < 6; ++i) worst = std::max(worst, relative(a[i], b[i]));
  return worst;
}

template <class S>
double off_orthogonal(const Matrix3<S>& R) {
  const Matrix3<S> gram = transpose(R) * R;
  double worst = relative(determinant(R), S(1));
  for (int i = 0; i < 9; ++i) worst = std::max(worst, relative(gram.m[i], S(i % 4 == 0)));
  return worst;
}

constexpr double few = 40;  // roundings of a dozen products of 3x3 matrices

}  // namespace

BOOST_AUTO_TEST_CASE_TEMPLATE(rotations_are_orthogonal, S, Scalars) {
  Draw<S> draw;
  for (double angle : {0.0, 1e-300, 1e-12, 1e-3, 0.009999, 0.010001, 1.0, 3.14159, 100.0, 1e8}) {
    const Vector3<S> a = draw.vector();
    const Vector3<S> axis = (S(1) / norm(a)) * a;
    BOOST_TEST(off_orthogonal(axis_rotation(axis, S(angle))) < few);
    if (angle < 10) BOOST_TEST(off_orthogonal(exp_rotation(S(angle) * axis)) < few);
    const Matrix3<S> A = axis_rotation(axis, S(angle)), B = exp_rotation(S(angle) * axis);
    if (angle < 10)
      for (int i = 0; i < 9; ++i) BOOST_TEST(relative(A.m[i], B.m[i]) < few);
  }
  const Matrix3<S> R = quaternion_rotation(Quaternion<S>{S(3), S(-1), S(2), S(0.5)});
  BOOST_TEST(off_orthogonal(R) < few);
  const Quaternion<S> q = rotation_quaternion(R);
  BOOST_TEST(relative(S(q.w * S(-1)), S(q.x * S(3))) < few);  // the direction of (3, -1, 2, .5)
}

BOOST_AUTO_TEST_CASE_TEMPLATE(logarithm_inverts_exponential, S, Scalars) {
  Draw<S> draw;
  for (double angle : {0.0, 1e-200, 1e-9, 0.5, 0.999, 1.001, 2.0, 3.1, 3.14159}) {
    const Vector3<S> a = draw.vector();
    const Vector6<S> twist{(S(angle) / norm(a)) * a, draw.vector()};
    const Vector3<S> w = log_quaternion(exp_quaternion(twist.angular));
    const Pose<S> X = exp_pose(twist);
    // Near a half turn the logarithm of the translation divides by 1 + cos: a condition of a few.
    BOOST_TEST(relative(log_pose(w, X.p), twist) < 10 * few);
    const Quaternion<S> q = rotation_quaternion(X.R);
    BOOST_TEST(relative(log_pose(log_quaternion(q), X.p), twist) < 1000 * few);  // the matrix holds a near half turn only to its root
  }
}

BOOST_AUTO_TEST_CASE_TEMPLATE(transforms_are_dual_and_compose, S, Scalars) {
  Draw<S> draw;
  for (int i = 0; i < 20; ++i) {
    const Pose<S> X = draw.pose(), Y = draw.pose();
    const Vector6<S> V = draw.six(), f = draw.six(), W = draw.six();
    BOOST_TEST(relative(dot(V, force_to_parent(X, f)), dot(motion_to_child(X, V), f)) < few);
    BOOST_TEST(relative(force_to_parent(X * Y, f), force_to_parent(X, force_to_parent(Y, f))) < few);
    BOOST_TEST(relative(motion_to_child(inverse(X), motion_to_child(X, V)), V) < few);
    BOOST_TEST(relative(dot(W, cross_force(V, f)), -dot(cross_motion(V, W), f)) < few);
  }
}

BOOST_AUTO_TEST_CASE_TEMPLATE(inertias_transform_as_operators, S, Scalars) {
  Draw<S> draw;
  for (int i = 0; i < 20; ++i) {
    const Pose<S> X = draw.pose();
    const RigidInertia<S> M = draw.inertia();
    const Vector6<S> V = draw.six();
    const Vector6<S> through = force_to_parent(X, M * motion_to_child(X, V));  // φMφ* V
    BOOST_TEST(relative(to_parent(X, M) * V, through) < few);
    const Symmetric6<S> P = symmetric6(M);
    BOOST_TEST(relative(P * V, M * V) < few);
    BOOST_TEST(relative(to_parent(X, P) * V, through) < few);
    // a general symmetric one: P - w w*
    Symmetric6<S> Q = P;
    const Vector6<S> w = draw.six();
    downdate(Q, w, w);
    BOOST_TEST(relative(Q * V, P * V - dot(w, V) * w) < few);
    const Vector6<S> f = draw.six();
    BOOST_TEST(relative(to_parent(X, Q) * V, force_to_parent(X, Q * motion_to_child(X, V))) < few);
    BOOST_TEST(relative(compliance_to_child(X, Q) * f, motion_to_child(X, Q * force_to_parent(X, f))) < few);
    Symmetric6<S> U = Symmetric6<S>::zero();
    add_symmetric_product(U, w, f);
    BOOST_TEST(relative(U * V, dot(f, V) * w + dot(w, V) * f) < few);
    annihilate(Q, 1);
    annihilate(Q, 4);
    const Vector6<S> y = Q * V;
    BOOST_TEST(to_double(y[1]) == 0.0);
    BOOST_TEST(to_double(y[4]) == 0.0);
  }
}
