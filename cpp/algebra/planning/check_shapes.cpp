#include "algebra/planning/check_shapes.h"

#include <algorithm>

#include "algebra/language/properties.h"
#include "runtime/errors.h"

namespace pycraft {

namespace {

class ShapeCheck {
 public:
  explicit ShapeCheck(const Plan& plan) : plan_(plan) {}

  void check(const Step& s) {
    step_ = &s;
    switch (s.kind) {
      case StepKind::multiply_blocks: return multiply();
      case StepKind::combine_blocks:
        for (size_t i = 0; i < s.in.size(); ++i) same(in(i).space, out().space), same(in(i).columns, out().columns);
        return;
      case StepKind::transpose_blocks: return same(in(0).space, out().columns), same(in(0).columns, out().space);
      case StepKind::invert_blocks:
      case StepKind::root_blocks: return square(in(0)), same(in(0).space, out().space), same(in(0).columns, out().columns);
      case StepKind::function_blocks:
        if (in(0).kind == RegisterKind::blocks) square(in(0)), same(in(0).space, out().space), same(in(0).columns, out().columns);
        return;
      case StepKind::congruence_blocks:
      case StepKind::lyapunov_blocks: return square(in(0)), square(out()), same(in(0).space, out().space);
      case StepKind::logdet_of_blocks: return square(in(0));
      case StepKind::trace_of_blocks:
      case StepKind::root_of_trace:
      case StepKind::diagonal_of_blocks: return require(cut_at_the_same_rows(in(0).space, in(0).columns), in(0).space, in(0).columns);
      case StepKind::apply_blocks: return as_long(in(0).columns, in(1).space), as_long(in(0).space, out().space);
      case StepKind::dense_factor:
        if (!s.flag) as_long(out().space, out().columns);
        return;
      case StepKind::dense_solve: return as_long(in(0).space, in(1).space), as_long(in(0).columns, out().space);
      case StepKind::combine:
        for (size_t i = 0; i < s.in.size(); ++i) as_long(in(i).space, out().space);
        return;
      default: return;
    }
  }

 private:
  const Register& in(size_t i) const { return plan_.registers[step_->in[i]]; }
  const Register& out() const { return plan_.registers[step_->out]; }

  void require(bool right, const Space& a, const Space& b) const {
    if (right) return;
    throw EvaluationError("the plan of " + plan_.text + " does not fit together at its step '" + step_kind_name(step_->kind) + "' (" + step_->text + "): " +
                          a.description() + " and " + b.description() + " are cut otherwise. This is a fault of the planner, not of the expression: please report it");
  }
  void multiply() const {
    same(in(0).columns, in(1).space), same(in(0).space, out().space), same(in(1).columns, out().columns);
  }
  void same(const Space& a, const Space& b) const { require(cut_equally(a, b), a, b); }
  void square(const Register& r) const { same(r.space, r.columns); }
  void as_long(const Space& a, const Space& b) const { require(a.dimension() == b.dimension(), a, b); }

  const Plan& plan_;
  const Step* step_ = nullptr;
};

}  // namespace

void check_shapes(const Plan& plan) {
  ShapeCheck shapes(plan);
  for (const Step& s : plan.steps) shapes.check(s);
}

}  // namespace pycraft
