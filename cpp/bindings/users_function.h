// Calls of functions that users gave: their errors stay what they are, with a note of whose function it was.
#pragma once

#include <string>
#include <type_traits>

#include "bindings/bindings.h"

namespace pycraft {

// call(), which calls the function `what` names, "the function of coupling 'gear'". An exception of its own goes on with that as a note
// (PEP 678: shown below its traceback; before Python 3.11 in __notes__ alone); what stops a program is left as it is. `what` may be a function,
// which is called where there is an exception.
template <class What, class F>
auto of_user(const What& what, F&& call) {
  try {
    return call();
  } catch (py::error_already_set& error) {
    if (!error.matches(PyExc_Exception)) throw;
    const py::object value = error.value();
    std::string whose;
    if constexpr (std::is_invocable_v<const What&>)
      whose = what();
    else
      whose = what;
    const py::str note("raised by " + whose);
    if (!py::hasattr(value, "__notes__")) py::setattr(value, "__notes__", py::list());
    const py::object notes = value.attr("__notes__");
    if (py::isinstance<py::list>(notes) && !notes.contains(note)) notes.cast<py::list>().append(note);
    throw;
  }
}

}  // namespace pycraft
