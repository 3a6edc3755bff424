#include "lanes/instructions.h"

#include <algorithm>

namespace pycraft::kernels {

namespace {

// Operations farther apart than this are not taken together: what a sum waits for keeps its place meanwhile.
constexpr int farthest = 64;
constexpr int most_takers = 3;

bool is_sum(Does does) { return does == Does::add || does == Does::subtract; }

template <class F>
void each_operand(const Operation& o, F&& f) {
  const int n = operands(o.does);
  if (n > 0) f(o.first);
  if (n > 1) f(o.second);
  if (n > 2) f(o.third);
}

class Writer {
 public:
  explicit Writer(const Tape& tape)
      : tape_(tape), uses_(tape.operations.size(), 0), taken_(tape.operations.size(), 0), made_(tape.operations.size(), 0) {
    out_.numbers = static_cast<int>(tape.operations.size());
    out_.one = out_.numbers++;
  }
  Instructions run() {
    choose_checks();
    count_uses();
    take_together();
    pair_sines();
    sort_what_leaves();
    for (int i = 0; i < static_cast<int>(uses_.size()); ++i) {
      if (uses_[i] && !taken_[i]) write(i);
      leave(i);
    }
    return std::move(out_);
  }

 private:
  struct Term {
    int a, b;  // b: -1 for a number, which is no product
    bool subtracted;
  };
  const Operation& at(int i) const { return tape_.operations[i]; }

  // A number that is not finite makes sums and products of it so, and results are looked through: only what goes no such way is checked.
  void choose_checks() {
    std::vector<char> shows(uses_.size(), 0), asked(uses_.size(), 0);
    for (const TapedResult& r : tape_.results) shows[r.from] = 1;
    for (int i : tape_.finite) asked[i] = 1;
    for (int i = static_cast<int>(uses_.size()) - 1; i >= 0; --i) {
      if (asked[i] && !shows[i]) checks_.push_back(i), shows[i] = 1;
      const Operation& o = at(i);
      if (!shows[i] || o.does > Does::logarithm) continue;
      if (o.does == Does::divide)
        shows[o.first] = 1;
      else
        each_operand(o, [&](int j) { shows[j] = 1; });
    }
  }

  void count_uses() {
    for (const TapedResult& r : tape_.results) ++uses_[r.from];
    for (const Guard& g : tape_.guards) ++uses_[at(g.truth).first], ++uses_[at(g.truth).second];
    for (int i : checks_) ++uses_[i];
    for (int i = static_cast<int>(uses_.size()) - 1; i >= 0; --i)
      if (uses_[i]) {
        each_operand(at(i), [&](int j) { ++uses_[j]; });
        if (subtracts(at(i))) --uses_[at(i).first], ++uses_[at(at(i).first).first];
      }
  }
  // c + (-a) b is c - a b.
  bool subtracts(const Operation& o) const { return o.does == Does::fused && at(o.first).does == Does::negate; }

  // ---------------------------------------------------------------- sums of products
  bool alone(int j, int of) const { return uses_[j] == 1 && of - j <= farthest; }
  // What sum i goes on with, -1: nothing; its other operand is a term.
  int begun(int i) const {
    const Operation& o = at(i);
    if (o.does == Does::fused) return at(o.third).does == Does::fused && alone(o.third, i) ? o.third : -1;
    if (!is_sum(o.does)) return -1;
    for (int j : {o.first, o.second})
      if (is_sum(at(j).does) && alone(j, i) && (j == o.first || o.does == Does::add)) return j;
    return -1;
  }
  // A product that goes into sums alone is taken anew in each: as a term it costs no more than its number would.
  void take_together() {
    std::vector<int> takers(uses_.size(), 0);
    for (int i = 0; i < static_cast<int>(uses_.size()); ++i) {
      const Operation& o = at(i);
      if (!uses_[i] || !(is_sum(o.does) || o.does == Does::fused)) continue;
      if (const int before = begun(i); before >= 0) taken_[before] = 1;
      const auto product = [&](int j) {
        if (at(j).does == Does::multiply && i - j <= farthest) ++takers[j];
      };
      if (o.does == Does::fused)
        product(o.third);
      else
        product(o.first), product(o.second);
    }
    for (size_t j = 0; j < uses_.size(); ++j)
      if (takers[j] > 0 && takers[j] == uses_[j] && uses_[j] <= most_takers) taken_[j] = 1;
  }
  Term term(int j, bool subtracted) const {
    if (taken_[j] && at(j).does == Does::multiply) return {at(j).first, at(j).second, subtracted};
    return {j, -1, subtracted};
  }
  void gather_terms(int i) {
    terms_.clear(), parts_.clear();
    for (int j = i; j >= 0; j = begun(j)) parts_.push_back(j);
    for (size_t p = parts_.size(); p-- > 0;) {
      const Operation& o = at(parts_[p]);
      const bool less = o.does == Does::subtract, first = p + 1 == parts_.size();
      if (o.does == Does::multiply) {
        terms_.push_back({o.first, o.second, false});
      } else if (o.does == Does::fused) {
        if (first) terms_.push_back(term(o.third, false));
        terms_.push_back({subtracts(o) ? at(o.first).first : o.first, o.second, subtracts(o)});
      } else if (first) {
        terms_.push_back(term(o.first, false)), terms_.push_back(term(o.second, less));
        if (!less && terms_[0].b >= 0 && terms_[1].b < 0) std::swap(terms_[0], terms_[1]);
      } else {
        terms_.push_back(term(o.first == parts_[p + 1] ? o.second : o.first, less));
      }
    }
  }
  bool constant(int i) const { return i == out_.one || at(i).does == Does::number; }
  // A factor of a sum, or its beginning.
  int operand(int i) const { return constant(i) ? ~i : i; }
  void write_sum(int i) {
    gather_terms(i);
    const size_t count = terms_.size();
    if (count == 2 && terms_[0].b < 0 && terms_[1].b < 0 && !constant(terms_[0].a) && !constant(terms_[1].a))
      return put(terms_[1].subtracted ? Code::subtract : Code::add, {terms_[0].a, terms_[1].a}, i);
    const bool fused = at(i).does == Does::fused;
    int before = -1;
    for (size_t done = 0; done < count;) {
      First first = First::number;
      piece_.clear();
      if (done == 0) {
        const Term& t = terms_[done++];
        first = t.b < 0 ? (constant(t.a) ? First::constant : First::number) : constant(t.a) ? First::multiple : First::product;
        piece_.push_back(operand(t.a));
        if (t.b >= 0) piece_.push_back(t.b);
      } else {
        piece_.push_back(before);
      }
      const size_t end = std::min(count, done + most_terms);
      unsigned kinds = 0;
      for (size_t t = done; t < end; ++t) {
        const int a = terms_[t].b < 0 ? out_.one : terms_[t].a, b = terms_[t].b < 0 ? terms_[t].a : terms_[t].b;
        kinds |= ((terms_[t].subtracted ? subtracted : 0u) | (constant(a) ? of_constant : 0u)) << 2 * (t - done);
        piece_.push_back(operand(a)), piece_.push_back(b);
      }
      before = end == count ? i : out_.numbers++;
      put(code_of_sum(fused, first, static_cast<int>(end - done), kinds), piece_.data(), piece_.size(), before);
      done = end;
    }
  }

  // ---------------------------------------------------------------- the others
  void put(int code, const int* reads, size_t count, int makes, int also_makes = -1) {
    for (size_t i = 0; i < count; ++i) fetch(reads[i]);
    out_.all.push_back({code, {makes, also_makes}, 0, 0, static_cast<int>(out_.reads.size()), static_cast<int>(count)});
    out_.reads.insert(out_.reads.end(), reads, reads + count);
  }
  void put(Code code, std::initializer_list<int> reads, int makes, int also_makes = -1) { put(static_cast<int>(code), reads.begin(), reads.size(), makes, also_makes); }
  // Inputs come when they are read first.
  void fetch(int i) {
    if (i < 0 || i >= static_cast<int>(made_.size()) || at(i).does != Does::input || made_[i]) return;
    made_[i] = 1;
    out_.all.push_back({static_cast<int>(Code::input), {i, -1}, at(i).first, at(i).second, 0, 0});
  }
  void write(int i) {
    const Operation& o = at(i);
    constexpr int same = static_cast<int>(Code::larger) - static_cast<int>(Does::larger);
    switch (o.does) {
      case Does::number:
      case Does::input: break;
      case Does::add:
      case Does::subtract:
      case Does::multiply:
      case Does::fused: write_sum(i); break;
      case Does::divide: put(Code::divide, {o.first, o.second}, i); break;
      case Does::negate: put(Code::negate, {o.first}, i); break;
      case Does::sine:
      case Does::cosine: write_sines(i, o); break;
      case Does::root: put(Code::root, {o.first}, i); break;
      case Does::logarithm: put(Code::logarithm, {o.first}, i); break;
      case Does::fraction: put(Code::fraction, {o.first}, i); break;
      case Does::exponent: put(Code::exponent, {o.first}, i); break;
      case Does::magnitude: put(Code::magnitude, {o.first}, i); break;
      default: {
        const int reads[] = {o.first, o.second, o.third};
        put(static_cast<int>(o.does) + same, reads, operands(o.does), i);
      }
    }
  }
  // Both of an angle at once.
  void pair_sines() {
    std::vector<int> of_angle(uses_.size(), -1);
    pair_.assign(uses_.size(), -1);
    for (int i = 0; i < static_cast<int>(uses_.size()); ++i) {
      const Operation& o = at(i);
      if (!uses_[i] || (o.does != Does::sine && o.does != Does::cosine)) continue;
      int& other = of_angle[o.first];
      if (other >= 0 && at(other).does != o.does) pair_[i] = other, pair_[other] = i;
      other = i;
    }
  }
  void write_sines(int i, const Operation& o) {
    if (made_[i]) return;
    const int other = pair_[i] >= 0 ? pair_[i] : out_.numbers++;
    if (pair_[i] >= 0) made_[pair_[i]] = 1;
    o.does == Does::sine ? put(Code::sines, {o.first}, i, other) : put(Code::sines, {o.first}, other, i);
  }

  // Guards, checks and results are written as soon as what they read is there.
  struct Leaving {
    int after;
    Code code;
    int first, second, entry;
  };
  void sort_what_leaves() {
    for (const TapedResult& r : tape_.results)
      if (at(r.from).does != Does::number) leaving_.push_back({r.from, Code::result, r.from, -1, r.entry});
    for (int i : checks_) leaving_.push_back({i, Code::finite, i, -1, 0});
    for (const Guard& g : tape_.guards) {
      const Operation& o = at(g.truth);
      const int which = static_cast<int>(o.does) - static_cast<int>(Does::greater), from = static_cast<int>(g.holds ? Code::require_greater : Code::refuse_greater);
      leaving_.push_back({std::max(o.first, o.second), static_cast<Code>(from + which), o.first, o.second, 0});
    }
    std::stable_sort(leaving_.begin(), leaving_.end(), [](const Leaving& a, const Leaving& b) { return a.after < b.after; });
  }
  void leave(int i) {
    for (; left_ < leaving_.size() && leaving_[left_].after <= i; ++left_) {
      const Leaving& l = leaving_[left_];
      l.second < 0 ? put(l.code, {l.first}, -1) : put(l.code, {l.first, l.second}, -1);
      out_.all.back().entry = l.entry;
    }
  }

  const Tape& tape_;
  std::vector<int> uses_;
  std::vector<char> taken_, made_;
  std::vector<int> checks_;
  std::vector<int> pair_;  // of a sine the cosine, and the other way round
  std::vector<Leaving> leaving_;
  size_t left_ = 0;
  std::vector<Term> terms_;
  std::vector<int> parts_, piece_;
  Instructions out_;
};

}  // namespace

Instructions instructions_of(const Tape& tape) { return Writer(tape).run(); }

}  // namespace pycraft::kernels
