// Ctrl-C during long calls, and threads that compute while the interpreter ends.
#include <atomic>
#include <chrono>
#include <thread>

#include "bindings/bindings.h"
#include "runtime/errors.h"
#include "runtime/interrupt.h"

namespace pycraft {

namespace {

UseCount& running() {  // of every thread; never destroyed: they may outlive the module
  static UseCount* const count = new UseCount;
  return *count;
}
std::atomic<std::thread::id> ends_in{};  // the thread in which the interpreter ends

void refuse_at_the_end() {
  const std::thread::id ending = ends_in.load();
  if (ending != std::thread::id() && ending != std::this_thread::get_id()) throw EvaluationError("the interpreter is about to end: nothing is computed any more");
}

std::thread::id main_thread;  // of Python; none where it is not known
unsigned forks_then = 0;

void check_signals() {
  refuse_at_the_end();
  // Python calls handlers in its main thread alone: the others do not ask for the GIL in vain.
  if (main_thread != std::thread::id() && main_thread != std::this_thread::get_id() && forks() == forks_then) return;
  const py::gil_scoped_acquire gil;
  if (PyErr_CheckSignals() != 0) throw py::error_already_set();
}

// Threads notice within some 50 ms; who holds out longer is left alone.
void wait_for_the_end() {
  ends_in = std::this_thread::get_id();
  const py::gil_scoped_release release;
  for (int i = 0; i < 1000 && running().users() > 0; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(5));
}

}  // namespace

ReleasedGil::ReleasedGil() {
  refuse_at_the_end();
  entered_ = running().enter();
  state_ = PyEval_SaveThread();
}

ReleasedGil::~ReleasedGil() {
  PyEval_RestoreThread(state_);
  running().leave(entered_);
}

void register_interrupts(py::module_&) {
  const auto threading = py::module_::import("threading");
  if (threading.attr("current_thread")().is(threading.attr("main_thread")())) main_thread = std::this_thread::get_id();
  forks_then = forks();
  set_interrupt_check(&check_signals);
  py::module_::import("atexit").attr("register")(py::cpp_function(&wait_for_the_end));
}

}  // namespace pycraft
