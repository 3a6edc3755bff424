// Derivatives of operators and scalars: along coordinates, time and parameters.
#include <cmath>

#include "algebra/theorems/differentiate.h"
#include "bindings/bindings.h"
#include "operators/derived_operators.h"
#include "operators/directions.h"
#include "operators/embedded_operators.h"
#include "runtime/errors.h"

namespace pycraft {

namespace {

// The one model of an expression, else of the spaces of its constants; null where it has none that moves.
std::shared_ptr<MultibodyOperators> model_of(const std::vector<Expression>& operands) {
  std::shared_ptr<MultibodyOperators> found;
  for (const Expression& e : operands)
    for (const Context& c : contexts(e)) {
      const auto own = mechanics_of(c.source);
      if (own && found && own != found)
        throw EvaluationError("operators of two models, '" + found->name() + "' and '" + own->name() + "': differentiate along a coordinate of either before they are combined");
      if (own) found = own;
    }
  for (const Expression& e : operands)
    if (!found && !e.floating()) found = mechanics_of(model_of_spaces(e).source);
  return found;
}

// The embedded loops that an expression has letters of; null where it has none.
std::shared_ptr<EmbeddedOperators> embedding_of(const std::vector<Expression>& operands) {
  std::shared_ptr<EmbeddedOperators> found;
  for (const Expression& e : operands)
    for (const Context& c : contexts(e)) {
      const auto own = std::dynamic_pointer_cast<EmbeddedOperators>(c.source);
      if (own && found && own != found)
        throw EvaluationError("operators of two embeddings of '" + own->base()->name() + "': differentiate along a coordinate of either before they are combined");
      if (own) found = own;
    }
  return found;
}

std::vector<Expression> operands_of(const Expression& e) { return {e}; }
std::vector<Expression> operands_of(const Scalar& s) {
  std::vector<Expression> all;
  visit(s, [&](const Expression& e) { all.push_back(e); });
  return all;
}

Expression along(const Expression& e, const Direction& direction, bool world) {
  return world ? differentiate_in_world(e, direction) : differentiate(e, direction);
}
Scalar along(const Scalar& s, const Direction& direction, bool) { return differentiate(s, direction); }
Expression nothing_of(const Expression& e) { return e.floating() ? e - e : with_batch_of(e, zero(e.domain(), e.codomain())); }
Scalar nothing_of(const Scalar& s) {
  for (const Expression& e : operands_of(s))
    if (batch_of(e) >= 0) return trace(with_batch_of(e, zero(e.domain(), e.domain())));
  return number(0);
}

int coordinate_of(const SkoSource& model, const py::object& direction) {
  const auto& names = model.structure().coordinate_names;
  if (!py::isinstance<py::str>(direction)) {
    const int i = clipped(direction);
    return i < 0 ? i + static_cast<int>(names.size()) : i;
  }
  const auto name = direction.cast<std::string>();
  const auto found = std::find(names.begin(), names.end(), name);
  if (found != names.end()) return static_cast<int>(found - names.begin());
  std::string text;
  for (size_t i = 0; i < names.size() && i < 12; ++i) text += (i ? ", " : "") + names[i];
  throw ModelError("no coordinate of '" + model.name() + "' is called '" + name + "'; there are " + text + (names.size() > 12 ? ", …" : ""));
}

template <class T>
T diff_in_turn(const T& operand, const py::args& directions, const std::string& frame) {
  if (frame != "body" && frame != "world") throw EvaluationError("frame '" + frame + "': derivatives are taken in \"body\" or \"world\" axes");
  if (directions.empty()) throw EvaluationError("diff takes a coordinate's name or number, or a parameter; for the time derivative there is dot()");
  T result = operand;
  for (const auto& item : directions) {
    const py::object direction = py::reinterpret_borrow<py::object>(item);
    if (py::isinstance<Parameter>(direction)) {
      const auto& parameter = direction.cast<const Parameter&>();
      const auto embedded = embedding_of(operands_of(operand));
      result = along(result, embedded ? *parameter_on_loops(embedded, parameter) : *parameter_direction(parameter), frame == "world");
      continue;
    }
    if (!py::isinstance<py::str>(direction) && !py::isinstance<py::int_>(direction) && !py::hasattr(direction, "__index__"))
      throw py::type_error("diff takes a coordinate's name or number, or a parameter such as body.symbol(\"mass\"), not " + std::string(py::repr(direction)));
    const auto model = model_of(operands_of(operand));
    if (!model) {
      result = nothing_of(result);
      continue;
    }
    if (const auto embedded = embedding_of(operands_of(operand))) {
      const int i = coordinate_of(*embedded, direction);
      if (i < 0 || i >= embedded->theta().dimension())
        throw ModelError("coordinate " + std::to_string(i) + " of '" + embedded->name() + "', which has " + std::to_string(embedded->theta().dimension()));
      result = along(result, *independent_direction(embedded, i), frame == "world");
      continue;
    }
    result = along(result, *coordinate_direction(model, coordinate_of(*model, direction)), frame == "world");
  }
  return result;
}

// diff([i, j]) is a list.
template <class T>
py::object diff(const T& operand, const py::args& directions, const std::string& frame) {
  if (directions.size() != 1 || !(py::isinstance<py::list>(directions[0]) || py::isinstance<py::tuple>(directions[0])))
    return py::cast(diff_in_turn(operand, directions, frame));
  py::list all;
  for (const auto& direction : directions[0]) all.append(py::cast(diff_in_turn(operand, py::args(py::make_tuple(direction)), frame)));
  return py::object(all);
}

template <class T>
T time_derivative(const T& operand, const py::object& vdot, const std::string& frame) {
  if (frame != "body" && frame != "world") throw EvaluationError("frame '" + frame + "': derivatives are taken in \"body\" or \"world\" axes");
  const auto model = model_of(operands_of(operand));
  if (!model) return nothing_of(operand);
  const auto embedded = embedding_of(operands_of(operand));
  Expression accelerations;
  if (py::isinstance<Expression>(vdot)) {
    accelerations = vdot.cast<Expression>();
  } else if (!vdot.is_none()) {
    const Array a = numbers(vdot, "vdot");
    const SkoSource& own = embedded ? static_cast<const SkoSource&>(*embedded) : *model;
    if (a.ndim() != 1 || a.shape(0) != own.theta().dimension())
      throw ModelError("vdot of '" + own.name() + "' takes " + std::to_string(own.theta().dimension()) + " numbers, or a vector of " + own.theta().description());
    for (py::ssize_t i = 0; i < a.size(); ++i)
      if (!std::isfinite(a.data()[i]))
        throw ModelError("vdot of '" + own.name() + "': coordinate '" + own.structure().coordinate_names[i] + "' is not a finite number");
    accelerations = constant(std::vector<double>(a.data(), a.data() + a.size()), Space::euclidean(1), own.theta(), "θ̈");
  }
  return along(operand, *time_direction(model, accelerations, embedded), frame == "world");
}

}  // namespace

void register_calculus(py::module_& m) {
  m.def("_moved", [](const std::vector<Expression>& operands) -> std::shared_ptr<SkoSource> {
    if (const auto embedded = embedding_of(operands)) return embedded;
    return model_of(operands);
  }, py::arg("operands"), "Whose coordinates diff() is along: embedded loops or a multibody model; None where nothing moves.");
  const char* on_loops = "The derivative along an independent coordinate of embedded loops, also of letters of the tree alone.";
  m.def("_diff_on_loops", [](const Expression& e, const std::shared_ptr<EmbeddedOperators>& of, int i) { return differentiate(e, *independent_direction(of, i)); }, py::arg("operand"),
        py::arg("of"), py::arg("coordinate"), on_loops);
  m.def("_diff_on_loops", [](const Scalar& s, const std::shared_ptr<EmbeddedOperators>& of, int i) { return differentiate(s, *independent_direction(of, i)); }, py::arg("operand"),
        py::arg("of"), py::arg("coordinate"), on_loops);
  const char* diff_text =
      "The derivative along a coordinate (its name or number), along a parameter (body.symbol(\"mass\"), hinge.symbol(\"axis\", 0), ...), or\n"
      "along several in turn: diff(i, j) is ∂_j(∂_i ·), and diff([i, j]) the list of both. An expression again, by rule, evaluated by sweeps; zero by structure is the zero\n"
      "operator. On ball and free hinges coordinates are quasi-velocities, along which derivatives do not commute.\n"
      "frame=\"world\": of the operator as resolved in world axes, given in body axes; spaces and shape are the operator's own.";
  const char* dot_text =
      "The time derivative along the model's velocity v; what depends on v itself needs the accelerations: vdot, an array (nv,) or a\n"
      "vector of Θ, of embedded loops θ̈_r. EvaluationError without them.";
  declared<py::class_<Expression>>(m, "Operator")
      .def("diff", &diff<Expression>, py::arg("frame") = "body", diff_text)
      .def("dot", &time_derivative<Expression>, py::arg("vdot") = py::none(), py::kw_only(), py::arg("frame") = "body", dot_text);
  declared<py::class_<Scalar>>(m, "Scalar")
      .def("diff", &diff<Scalar>, py::arg("frame") = "body", "The derivative along a coordinate or a parameter, as a scalar expression.")
      .def("dot", &time_derivative<Scalar>, py::arg("vdot") = py::none(), py::kw_only(), py::arg("frame") = "body", "The time derivative along the model's velocity.");

  py::class_<Parameter>(m, "Parameter", "What diff() takes beside a coordinate: a mass property, a rotor inertia, a placement, a hinge axis.")
      .def_readonly("name", &Parameter::name)
      .def("__repr__", [](const Parameter& p) { return "<parameter " + p.name + ">"; })
      .def("__reduce__", [](const Parameter& p) -> py::tuple {
        p.source->check_current();
        const py::module_ core = py::module_::import("pycraft._core");
        if (p.rotor >= 0) return py::make_tuple(core.attr("_rotor_parameter"), py::make_tuple(p.source, p.rotor, p.name));
        if (p.twists.empty()) return py::make_tuple(core.attr("_inertia_parameter"), py::make_tuple(p.source, p.inertia_body, static_cast<int>(p.inertia), p.name));
        py::list twists;
        for (const InsertedTwist& t : p.twists) twists.append(py::make_tuple(t.body, t.position, std::vector<double>(t.twist, t.twist + 6)));
        return py::make_tuple(core.attr("_twist_parameter"), py::make_tuple(p.source, twists, p.name));
      });
  m.def("_inertia_parameter", [](const std::shared_ptr<MultibodyOperators>& source, int body, int which, const std::string& name) {
    Parameter p{source, name, {}, body, static_cast<InertiaParameter>(which), -1};
    return p;
  });
  m.def("_rotor_parameter", [](const std::shared_ptr<MultibodyOperators>& source, int coordinate, const std::string& name) {
    return Parameter{source, name, {}, -1, InertiaParameter::mass, coordinate};
  });
  m.def("_twist_parameter", [](const std::shared_ptr<MultibodyOperators>& source, const std::vector<std::tuple<int, int, std::vector<double>>>& twists, const std::string& name) {
    Parameter p{source, name, {}, -1, InertiaParameter::mass, -1};
    for (const auto& [body, position, twist] : twists) {
      InsertedTwist t{body, position, {}};
      std::copy_n(twist.begin(), 6, t.twist);
      p.twists.push_back(t);
    }
    return p;
  });
}

}  // namespace pycraft
