#include "dynamics/states_together.h"

#include <algorithm>

#include "numerics/finite.h"
#include "runtime/fiber.h"

namespace pycraft {

namespace {

// Numbers of each state of a pack, one after the other.
template <class Of>
const double* laid(size_t states, size_t each, Of of, std::vector<double>& to) {
  if (!of(0)) return nullptr;
  to.resize(states * each);
  for (size_t b = 0; b < states; ++b) std::copy_n(of(b), each, to.data() + b * each);
  return to.data();
}

}  // namespace

bool StatesTogether::run(PreparedLinks& links, const double* q, const double* v, const double* u, const Vector6<double>* wrenches, double* out) {
  links.ask(q, v, u, wrenches, out);
  Asked asked{&links};
  waiting_.push_back(&asked);
  Fiber::pause();
  return asked.sound;
}

void StatesTogether::run(StatesInTurn& states) {
  Turns turns{&states};
  turns_.push_back(&turns);
  Fiber::pause();
  if (turns.error) std::rethrow_exception(turns.error);
}

void StatesTogether::answer() {
  // f() of those of a run, false at their end; an error is the run's own, and ends them.
  const auto each = [this](auto f) {
    std::erase_if(turns_, [&](Turns* of) {
      try {
        return !f(*of);
      } catch (const std::exception&) {
        of->error = std::current_exception();
        return true;
      }
    });
  };
  do {
    each([this](Turns& of) {
      of.asked.links = of.states->ask();
      if (of.asked.links) waiting_.push_back(&of.asked);
      return of.asked.links != nullptr;
    });
    answer_waiting();
    each([](Turns& of) {
      of.states->answer(of.asked.sound);
      return true;
    });
  } while (!turns_.empty());
}

void StatesTogether::answer_waiting() {
  while (!waiting_.empty()) {
    pack_.clear(), left_.clear();
    for (Asked* a : waiting_) (pack_.empty() || (pack_.size() < static_cast<size_t>(width()) && a->links->fits(*pack_.front()->links)) ? pack_ : left_).push_back(a);
    if (pack_.size() == 1)
      pack_.front()->sound = pack_.front()->links->answer();
    else
      answer_pack();
    waiting_.swap(left_);
  }
}

void StatesTogether::answer_pack() {
  const PreparedLinks& first = *pack_.front()->links;
  const kernels::Links<double>& links = first.model_->links();
  const kernels::Kernel<double>& kernel = kernels::instruction_set().pack[first.call_];
  const size_t states = pack_.size(), nq = links.nq, nv = links.nv, on_links = size_t(6) * links.count;
  const auto each = [&](auto member) { return [this, member](size_t b) { return pack_[b]->links->states_.*member; }; };
  kernels::States<double> at = first.states_;
  at.q = laid(states, nq, each(&kernels::States<double>::q), q_), at.q_stride = nq;
  at.v = laid(states, nv, each(&kernels::States<double>::v), v_), at.v_stride = nv;
  at.u = laid(states, nv, each(&kernels::States<double>::u), u_), at.u_stride = nv;
  if (first.call_ == kernels::Call::forward_dynamics) {
    at.gravity = laid(states, 3, each(&kernels::States<double>::gravity), gravity_), at.gravity_stride = 3;
    at.wrenches = laid(states, on_links, each(&kernels::States<double>::wrenches), wrenches_), at.wrench_stride = on_links;
  }
  at.states = static_cast<int>(states);
  out_.resize(states * nv);
  const unsigned sound = kernel.run(links, at, out_.data(), nv, work(kernel.work(links, 0)));
  for (size_t b = 0; b < states; ++b) {
    PreparedLinks& own = *pack_[b]->links;
    std::copy_n(out_.data() + b * nv, nv, own.out_);
    pack_[b]->sound = (sound >> b & 1) && all_finite(own.out_, static_cast<int>(nv));
    ++own.in_packs_;
  }
}

double* StatesTogether::work(size_t numbers) {
  if (numbers > size_) {
    work_.reset(static_cast<double*>(::operator new(numbers * sizeof(double), std::align_val_t(64))));
    size_ = numbers;
  }
  return work_.get();
}

}  // namespace pycraft
