// Every error of the core names the thing at fault. The bindings map these classes one to one to pycraft.<same name>.
#pragma once

#include <stdexcept>
#include <string>

namespace pycraft {

struct Error : std::runtime_error {
  using std::runtime_error::runtime_error;
};
// Operators that cannot be combined: their spaces do not meet. (TypeError in Python)
struct SpaceError : Error {
  using Error::Error;
};
// A model, a size or a number that makes no sense. (ValueError)
struct ModelError : Error {
  using Error::Error;
};
// A value that cannot be computed: a missing operand, an unknown name, a precision that is not there. (ValueError)
struct EvaluationError : Error {
  using Error::Error;
};
// D(k) singular at the rounding bound of the form in use. (ArithmeticError)
struct SingularHingeError : Error {
  SingularHingeError(const std::string& text, int at) : Error(text), coordinate(at) {}
  int coordinate;  // its number in the model
};
// Iterative refinement that does not contract. (ArithmeticError)
struct RefinementError : Error {
  using Error::Error;
};
// Any other inverse that does not exist numerically. (ArithmeticError)
struct SingularOperatorError : Error {
  using Error::Error;
};
// An operator made before its model's structure changed. (RuntimeError)
struct StaleOperatorError : Error {
  using Error::Error;
};

// f(); what numbers made impossible is told in the words of `retold(error)`, and what else the error knows stays.
template <class F, class Retold>
void retelling(F&& f, Retold retold) {
  try {
    f();
  } catch (const SingularHingeError& e) {
    throw SingularHingeError(retold(e), e.coordinate);
  } catch (const SingularOperatorError& e) {
    throw SingularOperatorError(retold(e));
  } catch (const RefinementError& e) {
    throw RefinementError(retold(e));
  }
}

// f(), its errors telling which state of a batch they come from.
template <class F>
void naming_state(int state, int states, F&& f) {
  if (states < 2) return f();
  const auto named = [&](const Error& e) { return e.what() + (" (state " + std::to_string(state) + " of a batch of " + std::to_string(states) + ")"); };
  try {
    retelling(f, named);
  } catch (const EvaluationError& e) {
    throw EvaluationError(named(e));
  }
}

}  // namespace pycraft
