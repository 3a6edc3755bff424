// Frames: the tree of them, and what they are asked for at the present state and at given ones.
#include <cmath>

#include "bindings/direct_calls.h"
#include "bindings/hinge_arguments.h"
#include "bindings/users_function.h"
#include "dynamics/frame_cache.h"
#include "dynamics/frame_calls.h"
#include "model/checks.h"
#include "runtime/of_state.h"

namespace pycraft {

namespace {

// A function of time in Python; it is let go under the GIL.
struct PythonMotion {
  py::object f;
  std::string frame;
  PythonMotion(py::object g, std::string of) : f(std::move(g)), frame(std::move(of)) {}
  PythonMotion(const PythonMotion&) = delete;
  ~PythonMotion() {
    py::gil_scoped_acquire gil;
    f = py::object();
  }

  FrameMotion operator()(double t) const {
    py::gil_scoped_acquire gil;
    const std::string what = "of the motion of frame '" + frame + "' at t = " + short_number(t);
    const py::object given = of_user("the motion of frame '" + frame + "' at t = " + short_number(t), [&] { return f(t); });
    FrameMotion motion;
    if (!py::isinstance<py::tuple>(given)) {
      motion.pose = pose(given, what);
      return motion;
    }
    const py::tuple parts = given;
    if (parts.empty() || parts.size() > 3)
      throw ModelError("the motion of frame '" + frame + "' returns a pose (4, 4), or (pose, twist) or (pose, twist, acceleration), not a tuple of " + std::to_string(parts.size()));
    motion.pose = pose(parts[0], what);
    if (parts.size() > 1) motion.velocity = six(parts[1], "the twist " + what);
    if (parts.size() > 2) motion.acceleration = six(parts[2], "the acceleration " + what);
    return motion;
  }

 private:
  static Pose<double> pose(const py::handle& given, const std::string& what) {
    const std::string name = "the pose " + what;
    const Array a = numbers(given, name.c_str());
    if (a.ndim() != 2 || a.shape(0) != 4 || a.shape(1) != 4) throw ModelError(name + " is a (4, 4) pose, not " + shape_text(a));
    const double* x = a.data();
    if (x[12] != 0 || x[13] != 0 || x[14] != 0 || x[15] != 1) throw ModelError(name + ": the last row of a pose is (0, 0, 0, 1)");
    Pose<double> X;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) X.R(i, j) = x[4 * i + j];
      X.p[i] = x[4 * i + 3];
    }
    return checked_pose(X, name);
  }
  static Vector6<double> six(const py::handle& given, const std::string& name) {
    const Array a = numbers(given, name.c_str());
    if (a.ndim() != 1 || a.shape(0) != 6) throw ModelError(name + " is six numbers, angular first, not " + shape_text(a));
    Vector6<double> V;
    for (int i = 0; i < 6; ++i) {
      V[i] = a.data()[i];
      if (!std::isfinite(V[i])) throw ModelError(name + " has an entry that is not a number");
    }
    return V;
  }
};

FrameFunction motion_function(const py::object& f, const std::string& frame) {
  if (f.is_none()) return nullptr;
  auto held = std::make_shared<PythonMotion>(f, frame);
  return [held](double t) { return (*held)(t); };
}

py::array_t<double> to_numpy(const Pose<double>& X) {
  py::array_t<double> out({4, 4});
  double* to = out.mutable_data();
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) to[4 * i + j] = X.R(i, j);
    to[4 * i + 3] = X.p[i];
    to[12 + i] = 0;
  }
  to[15] = 1;
  return out;
}
py::array_t<double> to_numpy(const Vector6<double>& V) {
  py::array_t<double> out(6);
  for (int i = 0; i < 6; ++i) out.mutable_data()[i] = V[i];
  return out;
}

MotionAxes axes_from(const std::string& name) {
  for (const auto& [axes, known] : {std::pair{MotionAxes::body, "body"}, {MotionAxes::aligned, "aligned"}, {MotionAxes::world, "world"}, {MotionAxes::other, "other"}})
    if (name == known) return axes;
  throw EvaluationError("axes '" + name + "': there are 'body', 'aligned', 'world', and those of a frame");
}

// Of one model: its frames, what is kept of them, and calls at given states.
struct Frames {
  explicit Frames(std::shared_ptr<Multibody> model) : tree(std::make_shared<FrameTree>(std::move(model))), cache(tree), calls(tree) {}
  std::shared_ptr<FrameTree> tree;
  FrameCache cache;
  FrameCalls calls;

  FrameQuestion question(const std::string& frame, const std::string& other, const std::string& axes, const std::string& third) const {
    FrameQuestion asked{tree->find(frame), tree->find(other), axes_from(axes)};
    if (asked.axes == MotionAxes::other) asked.third = tree->find(third);
    return asked;
  }
  RelativeMotion<double> now(FrameNumber frame, FrameNumber other, MotionPart part) {
    const ReleasedGil release;
    return cache.motion(frame, other, part);
  }
};

// What a call at given states reads, and how many states that are: -1 one, without a leading axis.
struct States {
  Arguments given;
  std::vector<double> t;
  int batch;
  States(const Multibody& model, const std::vector<std::pair<const char*, py::object>>& all, const py::object& time) : given(model, all), batch(given.batch) {
    const Array a = numbers(time, "t");
    if (a.ndim() > 1) throw ModelError("t is a number, or one a state, not " + shape_text(a));
    t.assign(a.data(), a.data() + a.size());
    for (size_t b = 0; b < t.size(); ++b)
      checking_state(static_cast<int>(b), static_cast<int>(t.size()), [&] {
        if (!std::isfinite(t[b])) throw ModelError("t has an entry that is not a finite number");
      });
    if (a.ndim() == 0) return;
    const int times = static_cast<int>(a.size());
    if (batch >= 0 && batch != times) throw ModelError("t has " + std::to_string(times) + " times for " + std::to_string(batch) + " states");
    batch = times;
  }
  int count() const { return batch < 0 ? 1 : batch; }
};

py::array_t<double> motion_at(Frames& f, const FrameQuestion& asked, MotionPart part, bool classical, States states, Precision precision) {
  const FrameTimes times = f.calls.times(asked, states.t);
  py::array_t<double> out = part == MotionPart::pose ? output(py::none(), states.batch, {4, 4}) : output(py::none(), states.batch, {6});
  double* const to = out.mutable_data();
  const std::vector<Given> given = states.given.given();
  const Undisturbed undisturbed(f.tree->model());
  for (const Given& g : given) check_given(f.tree->model(), {g});
  if (part == MotionPart::pose)
    f.calls.motion(asked, part, classical, {given[0]}, times, precision, states.count(), to);
  else if (part == MotionPart::velocity)
    f.calls.motion(asked, part, classical, {given[0], given[1]}, times, precision, states.count(), to);
  else
    f.calls.motion(asked, part, classical, {given[0], given[1], given[2]}, times, precision, states.count(), to);
  return out;
}

}  // namespace

void register_frames(py::module_& m) {
  const py::arg frame("frame"), other("other"), axes("axes"), third("third"), q("q"), v("v"), t("t"), precision("precision");
  py::class_<Frames> frames(m, "FrameTree", "The frames of a model, by name, and their motions relative to each other: pycraft.models.frame_tree is its face.");
  unpicklable(frames)
      .def(py::init<std::shared_ptr<Multibody>>())
      .def("add", [](Frames& f, const std::string& name, const std::string& on, const py::object& rotation, const py::object& position, const py::object& motion) {
        f.tree->add(name, on, pose_from(rotation, position, "frame '" + name + "'"), motion_function(motion, name));
      }, py::arg("name"), py::arg("on"), py::arg("rotation"), py::arg("position"), py::arg("motion"))
      .def("place", [](Frames& f, const std::string& name, const py::object& rotation, const py::object& position) {
        f.tree->move(name, pose_from(rotation, position, "frame '" + name + "'"));
      }, py::arg("name"), py::arg("rotation"), py::arg("position"))
      .def("set_motion", [](Frames& f, const std::string& name, const py::object& motion) { f.tree->move(name, motion_function(motion, name)); }, py::arg("name"), py::arg("motion"))
      .def("attach", [](Frames& f, const std::string& name, const std::string& on) { f.tree->attach(name, on); }, py::arg("name"), py::arg("on"))
      .def("remove", [](Frames& f, const std::string& name) { f.tree->remove(name); }, py::arg("name"))
      .def("loose_names", [](const Frames& f) { return f.tree->loose_names(); })
      .def("is_loose", [](const Frames& f, const std::string& name) { return f.tree->is_loose(name); }, py::arg("name"))
      .def("number", [](const Frames& f, const std::string& name) { return f.tree->find(name); }, py::arg("name"),
           "-1 the base, then bodies, then nodes; below -1 loose frames. ModelError with the nearest name.")
      .def("carrier", [](const Frames& f, const std::string& name) { return f.tree->name(f.tree->carrier(f.tree->find(name))); }, py::arg("name"),
           "The name of what a frame stands on, empty for the base.")
      .def("on", [](const Frames& f, const std::string& name) { return f.tree->loose(name).on; }, py::arg("name"), "The name of what a loose frame was put on, whether it is there or not.")
      .def("placement", [](const Frames& f, const std::string& name) { return to_numpy(f.tree->loose(name).pose); }, py::arg("name"))
      .def_property("time", [](const Frames& f) { return f.cache.time(); }, [](Frames& f, const py::object& t) { f.cache.set_time(one_number(t, "t")); })
      .def_property("accelerations", [](Frames& f) { return pycraft::to_numpy(f.cache.accelerations()); },
                    [](Frames& f, const py::object& vdot) { f.cache.set_accelerations(one_state(vdot, "vdot")); })
      .def("counts", [](const Frames& f) {
        const auto c = f.cache.counts();
        return std::array<std::uint64_t, 4>{c.steps[0], c.steps[1], c.steps[2], c.pairs};
      }, "How many poses, velocities and accelerations of steps were computed at the present state, and how many motions of pairs.")
      .def("pose", [](Frames& f, const std::string& frame, const std::string& other) {
        return to_numpy(f.now(f.tree->find(frame), f.tree->find(other), MotionPart::pose).X);
      }, frame, other)
      .def("motion", [](Frames& f, const std::string& frame, const std::string& other, const std::string& axes, const std::string& third, const py::object& acceleration) {
        const FrameQuestion asked = f.question(frame, other, axes, third);
        const bool of_velocity = acceleration.is_none();
        const RelativeMotion<double> m = f.now(asked.frame, asked.other, of_velocity ? MotionPart::velocity : MotionPart::acceleration);
        const Matrix3<double> R = asked.axes == MotionAxes::other ? f.now(asked.frame, asked.third, MotionPart::pose).X.R : Matrix3<double>::identity();
        return to_numpy(of_velocity ? in_axes(asked.axes, m, R, m.V) : acceleration_in_axes(asked.axes, m, R, acceleration.cast<std::string>() == "classical"));
      }, frame, other, axes, third, py::arg("acceleration"), "The velocity, or the 'spatial' or 'classical' acceleration, at the present state.")
      .def("pose_at", [](Frames& f, const std::string& frame, const std::string& other, const py::object& q, const py::object& t, Precision precision) {
        return motion_at(f, f.question(frame, other, "body", ""), MotionPart::pose, false, States(f.tree->model(), {{"q", q}}, t), precision);
      }, frame, other, q, t, precision)
      .def("velocity_at", [](Frames& f, const std::string& frame, const std::string& other, const std::string& axes, const std::string& third, const py::object& q,
                             const py::object& v, const py::object& t, Precision precision) {
        return motion_at(f, f.question(frame, other, axes, third), MotionPart::velocity, false, States(f.tree->model(), {{"q", q}, {"v", v}}, t), precision);
      }, frame, other, axes, third, q, v, t, precision)
      .def("acceleration_at", [](Frames& f, const std::string& frame, const std::string& other, const std::string& axes, const std::string& third, const std::string& kind,
                                 const py::object& q, const py::object& v, const py::object& vdot, const py::object& t, Precision precision) {
        return motion_at(f, f.question(frame, other, axes, third), MotionPart::acceleration, kind == "classical",
                         States(f.tree->model(), {{"q", q}, {"v", v}, {"vdot", vdot}}, t), precision);
      }, frame, other, axes, third, py::arg("kind"), q, v, py::arg("vdot"), t, precision)
      .def("jacobian", [](Frames& f, const std::string& frame, const std::string& other, const std::string& axes, const std::string& third,
                          const std::optional<std::vector<int>>& coordinates, const py::object& q, const py::object& v, const py::object& t, Precision precision) {
        const FrameQuestion asked = f.question(frame, other, axes, third);
        std::vector<std::pair<const char*, py::object>> state = {{"q", q}};
        if (!v.is_none()) state.emplace_back("v", v);
        States states(f.tree->model(), state, t);
        const FrameTimes times = f.calls.times(asked, states.t);
        const int columns = coordinates ? static_cast<int>(coordinates->size()) : f.tree->model().nv();
        py::array_t<double> out = output(py::none(), states.batch, {6, columns});
        double* const to = out.mutable_data();
        const std::vector<Given> given = states.given.given();
        const Undisturbed undisturbed(f.tree->model());
        const bool rates = given.size() == 2;
        const std::vector<int>* const chosen = coordinates ? &*coordinates : nullptr;
        if (rates)
          f.calls.jacobian(asked, chosen, rates, {given[0], given[1]}, times, precision, states.count(), to);
        else
          f.calls.jacobian(asked, chosen, rates, {given[0]}, times, precision, states.count(), to);
        return out;
      }, frame, other, axes, third, py::arg("coordinates"), q, v, t, precision, "The Jacobian, or where v is given its time derivative.");
}

}  // namespace pycraft
