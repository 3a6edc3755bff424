// The way to compute: the precision, the form of the articulated-inertia sweep, and iterative refinement of what is solved.
#pragma once

#include <string>

#include "numerics/scalar.h"

namespace pycraft {

enum class Precision { single, double_, extended, quad, digits50, digits100 };
inline constexpr Precision precisions[] = {Precision::single, Precision::double_, Precision::extended, Precision::quad, Precision::digits50, Precision::digits100};
const char* precision_name(Precision precision);
// Throws EvaluationError that lists the names there are.
Precision precision_from_name(const std::string& name);

// f(S()) for the scalar of this precision.
template <class F>
void at_precision(Precision precision, F f) {
  switch (precision) {
    case Precision::single: return f(Single());
    case Precision::double_: return f(double());
    case Precision::extended: return f(Extended());
    case Precision::quad: return f(Quad());
    case Precision::digits50: return f(Digits50());
    case Precision::digits100: return f(Digits100());
  }
}

// How the articulated inertia is carried from body to body: as P; as U diag(w) U*; as L L*. See sweeps/articulated_inertia.h.
enum class Form { fast, ud, square_root };
inline constexpr Form forms[] = {Form::fast, Form::ud, Form::square_root};
const char* form_name(Form form);
Form form_from_name(const std::string& name);

// What a residual is formed in: the precision itself; that, with the gather of forces to the base one precision up; all of it one up.
// (Errors of motions do little harm: ℳ⁻¹HφM has norm 1 in the energy. Errors of forces are multiplied by ℳ⁻¹Hφ.)
enum class ResidualPrecision { same, gather, wider };
inline constexpr ResidualPrecision residual_precisions[] = {ResidualPrecision::same, ResidualPrecision::gather, ResidualPrecision::wider};
const char* residual_precision_name(ResidualPrecision residual);
ResidualPrecision residual_precision_from_name(const std::string& name);

// Iterative refinement: the number of corrections, or as many as make them shrink, and what their residuals are formed in.
struct Refinement {
  static constexpr int automatic = -1;
  int steps = 0;
  ResidualPrecision residual = ResidualPrecision::same;
  bool wider() const { return residual == ResidualPrecision::wider; }
  bool gathers_wider() const { return residual == ResidualPrecision::gather; }
  bool operator==(const Refinement&) const = default;
};

struct Arithmetic {
  Form form = Form::fast;
  Refinement refinement;
  Precision precision = Precision::double_;
  bool operator==(const Arithmetic&) const = default;
};

}  // namespace pycraft
