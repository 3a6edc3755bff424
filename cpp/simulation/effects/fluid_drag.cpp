#include "simulation/effects/fluid_drag.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "model/checks.h"
#include "model/unit_data.h"
#include "runtime/errors.h"

namespace pycraft {

namespace {

template <class S>
class BoundFluidDrag : public BoundEffect<S> {
 public:
  explicit BoundFluidDrag(const FluidDrag& of) : wind_(cast<S>(of.wind)) {
    for (const BoxInFluid& given : of.boxes) {
      Box box{given.body, renormalised<S>(given.pose), {}, {}, S(0), S(0)};
      const Vector3<double>& s = given.size;
      for (int i = 0; i < 3; ++i) {
        const double b = s[(i + 1) % 3], c = s[(i + 2) % 3];
        box.face[i] = S(0.5 * of.density * b * c);
        box.turning[i] = S(of.density * s[i] * (b * b * b * b + c * c * c * c) / 64);
      }
      const double d = (s[0] + s[1] + s[2]) / 3;
      box.viscous = S(3 * std::numbers::pi * of.viscosity * d);
      box.viscous_turning = S(std::numbers::pi * of.viscosity * d * d * d);
      boxes_.push_back(box);
    }
  }
  void forces(const At<S>& at, const Forces<S>& out) override {
    using std::abs;
    for (const Box& box : boxes_) {
      const auto [w, v] = motion(box, at);
      Vector3<S> n, f;
      for (int i = 0; i < 3; ++i) {
        f[i] = -(box.face[i] * S(abs(v[i])) + box.viscous) * v[i];
        n[i] = -(box.turning[i] * S(abs(w[i])) + box.viscous_turning) * w[i];
      }
      const Vector3<S> force = box.pose.R * f;
      out.wrench[box.body] = out.wrench[box.body] + Vector6<S>{box.pose.R * n + cross(box.pose.p, force), force};
    }
  }
  std::optional<Edge> edge(const At<S>& at) override {
    for (const Box& box : boxes_) {
      const auto [w, v] = motion(box, at);
      for (int i = 0; i < 3; ++i)
        if ((v[i] == S(0) && !(box.face[i] == S(0))) || (w[i] == S(0) && !(box.turning[i] == S(0)))) return Edge{"has a body at rest in the fluid, where |v| v bends"};
    }
    return {};
  }

 private:
  struct Box {
    int body;
    Pose<S> pose;
    Vector3<S> face, turning;  // of |v| v and |ω| ω, by axis
    S viscous, viscous_turning;
  };
  struct Motion {
    Vector3<S> w, v;
  };
  // Of a box against the fluid, in the box's axes, the velocity at its centre.
  Motion motion(const Box& box, const At<S>& at) const {
    const Vector6<S>& V = at.twist[box.body];
    const Vector3<S> v = V.linear + cross(V.angular, box.pose.p) - transpose_times(at.pose[box.body].R, wind_);
    return {transpose_times(box.pose.R, V.angular), transpose_times(box.pose.R, v)};
  }
  Vector3<S> wind_;
  std::vector<Box> boxes_;
};

void check_of_fluid(double x, const char* what) {
  if (!(x >= 0) || !std::isfinite(x)) throw ModelError(std::string("fluid_drag: ") + what + " is " + short_number(x) + "; it is zero or more");
}

}  // namespace

FluidDrag::FluidDrag(double rho, double beta, const Vector3<double>& w, std::vector<BoxInFluid> in) : density(rho), viscosity(beta), wind(w), boxes(std::move(in)) {
  check_of_fluid(density, "density");
  check_of_fluid(viscosity, "viscosity");
  for (int i = 0; i < 3; ++i)
    if (!std::isfinite(wind[i])) throw ModelError("fluid_drag: wind has an entry that is " + short_number(wind[i]));
  for (const BoxInFluid& box : boxes)
    for (int i = 0; i < 3; ++i) check_of_fluid(box.size[i], "an edge of a box");
}

Declaration FluidDrag::declaration() const {
  Declaration d;
  d.velocities = d.work = true;
  d.only_in_motion = wind[0] == 0 && wind[1] == 0 && wind[2] == 0;
  for (const BoxInFluid& box : boxes)
    if (std::find(d.poses.begin(), d.poses.end(), box.body) == d.poses.end()) d.poses.push_back(box.body);  // each body once, whatever boxes it has
  d.twists = d.wrenches = d.poses;
  return d;
}

PYCRAFT_BIND_EFFECT(FluidDrag, BoundFluidDrag)

}  // namespace pycraft
