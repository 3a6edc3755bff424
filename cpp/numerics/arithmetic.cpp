#include "numerics/arithmetic.h"

#include "runtime/errors.h"

namespace pycraft {

const char* precision_name(Precision precision) {
  static const char* names[] = {"single", "double", "extended", "quad", "50", "100"};
  return names[static_cast<int>(precision)];
}

Precision precision_from_name(const std::string& name) {
  for (const Precision p : precisions)
    if (name == precision_name(p)) return p;
  throw EvaluationError("no precision is called '" + name + "'; there are 'single', 'double', 'extended', 'quad', and 50 and 100 digits; "
                        "pycraft.reference computes with any number of them");
}

const char* form_name(Form form) {
  static const char* names[] = {"fast", "ud", "square-root"};
  return names[static_cast<int>(form)];
}

Form form_from_name(const std::string& name) {
  for (const Form f : forms)
    if (name == form_name(f)) return f;
  throw EvaluationError("no form of the articulated-inertia sweep is called '" + name + "'; there are 'fast', 'ud' and 'square-root'" +
                        (name == "joseph" ? "; 'joseph' is an exhibit of pycraft.reference" : ""));
}

const char* residual_precision_name(ResidualPrecision residual) {
  static const char* names[] = {"same", "gather", "wider"};
  return names[static_cast<int>(residual)];
}

ResidualPrecision residual_precision_from_name(const std::string& name) {
  for (const ResidualPrecision r : residual_precisions)
    if (name == residual_precision_name(r)) return r;
  throw EvaluationError("residual '" + name + "' is not there; there are 'same' (the precision itself), 'gather' (forces are gathered in the next one up) "
                        "and 'wider' (all of it is formed in the next one up)");
}

}  // namespace pycraft
