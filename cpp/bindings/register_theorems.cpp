#include "algebra/theorems/theorems.h"

#include "algebra/engine/evaluate.h"
#include "algebra/language/display.h"
#include "algebra/trees/matrix_tree.h"
#include "bindings/bindings.h"
#include "operators/loop_theorems.h"
#include "operators/multibody_operators.h"
#include "runtime/errors.h"

namespace pycraft {

namespace {

std::shared_ptr<LoopOperators> rows_of(const std::shared_ptr<SkoSource>& source) {
  auto rows = std::dynamic_pointer_cast<LoopOperators>(source);
  if (!rows) throw EvaluationError("'" + source->name() + "' is no source of rows of loops");
  return rows;
}

}  // namespace

void register_theorems(py::module_& m) {
  const auto side = [](const Side& s) -> py::object {
    return std::holds_alternative<Expression>(s) ? py::cast(std::get<Expression>(s)) : py::cast(std::get<Scalar>(s));
  };
  py::class_<Theorem>(m, "Theorem", "A theorem as data: both sides as expressions, its hypotheses, its source.")
      .def_readonly("name", &Theorem::name)
      .def_readonly("group", &Theorem::group)
      .def_property_readonly("lhs", [side](const Theorem& t) { return side(t.lhs); })
      .def_property_readonly("rhs", [side](const Theorem& t) { return side(t.rhs); })
      .def_property_readonly("hypotheses", [](const Theorem& t) { return hypothesis_names(t.hypotheses); })
      .def_readonly("source", &Theorem::source)
      .def_readonly("on_one_path", &Theorem::on_one_path)
      .def_readonly("at_most", &Theorem::at_most)
      .def_readonly("waiting", &Theorem::waiting)
      .def_property_readonly("use", [](const Theorem& t) {
        static const char* names[] = {"check", "rewrite", "inverse"};
        return names[static_cast<int>(t.use)];
      })
      .def("unmet", [](const Theorem& t, const SkoSource& s) { return hypothesis_names(unmet(t.hypotheses, s.traits())); }, "Hypotheses that the model does not meet.")
      .def_property_readonly("latex", [](const Theorem& t) {
        if (!t.latex.empty()) return t.latex;
        const auto tex = [](const Side& s) {
          return std::holds_alternative<Expression>(s) ? show_in_full(std::get<Expression>(s), Style::latex) : show(std::get<Scalar>(s), Style::latex);
        };
        return t.waiting.empty() ? tex(t.lhs) + (t.at_most ? " \\le " : " = ") + tex(t.rhs) : "\\text{" + t.name + "}";
      })
      .def_property_readonly("text", [](const Theorem& t) {
        if (!t.text.empty()) return t.text;
        const auto text = [](const Side& s) { return std::holds_alternative<Expression>(s) ? show_in_full(std::get<Expression>(s)) : show(std::get<Scalar>(s)); };
        return t.waiting.empty() ? text(t.lhs) + (t.at_most ? " ≤ " : " = ") + text(t.rhs) : t.name;
      })
      .def("__reduce__", [side](const Theorem& t) -> py::tuple {
        const bool waits = !t.waiting.empty();
        return py::make_tuple(py::module_::import("pycraft._core").attr("_theorem_from_parts"),
                              py::make_tuple(t.name, t.group, waits ? py::none() : side(t.lhs), waits ? py::none() : side(t.rhs),
                                             static_cast<unsigned>(t.hypotheses), t.source, static_cast<int>(t.use), t.on_one_path, t.at_most, t.waiting, t.text, t.latex));
      })
      .def("_repr_html_", [](const Theorem& t) { return of_face("theorem_html")(t); })
      .def("__repr__", [](const Theorem& t) { return "<theorem " + t.name + ">"; });
  m.def("_theorem_from_parts", [](std::string name, std::string group, const py::object& lhs, const py::object& rhs, unsigned hypotheses, std::string source,
                                  int use, bool on_one_path, bool at_most, std::string waiting, std::string text, std::string latex) {
    const auto given = [](const py::object& s) -> Side {
      if (s.is_none()) return Expression();
      return py::isinstance<Scalar>(s) ? Side(s.cast<Scalar>()) : Side(s.cast<Expression>());
    };
    return Theorem{std::move(name), std::move(group), given(lhs), given(rhs), static_cast<Hypothesis>(hypotheses), std::move(source),
                   static_cast<Use>(use), on_one_path, at_most, std::move(waiting), std::move(text), std::move(latex)};
  });
  m.def("theorems", [](const std::shared_ptr<SkoSource>& source) {
    std::vector<Theorem> all = sko_theorems(source);
    if (const auto mechanics = std::dynamic_pointer_cast<MultibodyOperators>(source)) {
      const std::vector<Theorem> more = mechanics_theorems(mechanics);
      all.insert(all.end(), more.begin(), more.end());
    }
    if (const auto embedded = std::dynamic_pointer_cast<EmbeddedOperators>(source)) {
      const std::vector<Theorem> more = embedding_theorems(embedded);
      all.insert(all.end(), more.begin(), more.end());
    }
    return all;
  }, py::arg("source"), "Every theorem, stated on the letters of one model.");
  m.def("_theorems_of_rows", [](const std::shared_ptr<SkoSource>& loops) { return augmentation_theorems(rows_of(loops)); }, py::arg("loops"),
        "What holds of a source of rows and of the tree that they are declared on.");
  m.def("_whole_rows", [](const std::shared_ptr<SkoSource>& loops, const std::string& letter) { return rows_of(loops)->whole(letter); }, py::arg("loops"), py::arg("letter"),
        "Q or A of a source of rows, to R^rows.");
  m.def("_rows_by_ends", [](const std::shared_ptr<SkoSource>& loops) { return rows_of(loops)->by_ends(); }, py::arg("loops"),
        "A B* φ* H*, which Q of a source of rows is where all loops are of two ends; None where they are not.");
  m.def("residual", [](const py::object& a, const py::object& b, const std::map<std::string, std::vector<double>>& vectors, bool on_one_path, bool at_most) {
    Residual r;
    if (py::isinstance<Scalar>(a)) {
      const Scalar x = a.cast<Scalar>(), y = b.cast<Scalar>();
      ReleasedGil release;
      r = residual(x, y);
    } else {
      const Expression x = a.cast<Expression>(), y = b.cast<Expression>();
      ReleasedGil release;
      r = residual(x, y, vectors, on_one_path, at_most);
    }
    return py::make_tuple(r.difference, r.left, r.right);
  }, py::arg("a"), py::arg("b"), py::arg("vectors") = std::map<std::string, std::vector<double>>(), py::arg("on_one_path") = false, py::arg("at_most") = false,
        "Largest entries of a - b, a and b: both evaluated as typed, no theorem used, the difference taken at the bound precision.");
}

}  // namespace pycraft
