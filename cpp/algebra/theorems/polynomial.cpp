#include "algebra/theorems/polynomial.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <deque>
#include <mutex>

#include "algebra/language/lower.h"
#include "algebra/language/patterns.h"
#include "algebra/language/properties.h"
#include "algebra/language/source.h"
#include "algebra/theorems/rules.h"
#include "runtime/interrupt.h"
#include "runtime/mutex.h"

namespace pycraft {

namespace {

using enum SymbolId;

constexpr size_t word_limit = 400, step_limit = 20000, visit_limit = 100000;

struct Unfolded {
  const Symbol* symbol = nullptr;
  bool transposed = false, inverted = false;
};

Unfolded unfold(const Expression& atom) {
  Unfolded u;
  const Expression* e = &atom;
  while (e->kind() == NodeKind::transpose || e->kind() == NodeKind::inverse) {
    (e->kind() == NodeKind::transpose ? u.transposed : u.inverted) ^= true;
    e = &e->children()[0];
  }
  if (e->kind() == NodeKind::symbol) u.symbol = &e->node().symbol;
  return u;
}

Expression fold(Expression e, bool transposed, bool inverted) {
  if (transposed) e = e.T();
  if (inverted) e = e.inv();
  return e;
}

}  // namespace

int Alphabet::letter(const Expression& atom) {
  // Inverse outside, transpose inside, whatever the order they came in.
  const Unfolded u = unfold(atom);
  Expression canonical = atom;
  if (u.symbol && u.transposed && u.inverted) {
    Expression base = atom;
    while (base.kind() != NodeKind::symbol) base = base.children()[0];
    canonical = fold(base, true, true);
  }
  const auto found = numbers_.find(canonical);
  if (found != numbers_.end()) return found->second;
  const int number = static_cast<int>(atoms_.size());
  atoms_.push_back(canonical);
  const bool known = u.symbol && u.symbol->definition->kind() == LetterKind::sko;
  codes_.push_back(known ? letter_code(u.symbol->definition->id, u.transposed, u.inverted) : -1);
  zero_.push_back(known && u.symbol->definition->id == J && !u.symbol->source->traits().hinge_diagonal);
  numbers_.emplace(canonical, number);
  return number;
}

int Alphabet::sibling(int like, int code) {
  const auto [known, fresh] = siblings_.try_emplace({like, code}, -1);
  if (fresh) {
    const Symbol& s = *unfold(atoms_[like]).symbol;
    known->second = letter(fold(make_symbol(static_cast<SymbolId>(code / 4), s.source, s.binding), code & 2, code & 1));
  }
  return known->second;
}

int Alphabet::inverse_of(int l) {
  const Expression e = atoms_[l];
  return letter(e.kind() == NodeKind::inverse ? e.children()[0] : e.inv());
}

namespace {

class Normaliser {
 public:
  explicit Normaliser(Alphabet& alphabet) : alphabet_(alphabet) {}

  std::optional<Polynomial> run(const Expression& lowered) {
    Polynomial p = expand(lowered);
    if (!overflow_) p = reduce(p);
    if (overflow_) return std::nullopt;
    return p;
  }

 private:
  // Distributes products over sums; letters are interned.
  Polynomial expand(const Expression& e) {
    check_interrupt();
    if (overflow_ || ++visited_ > visit_limit) {
      overflow_ = true;
      return {};
    }
    switch (e.kind()) {
      case NodeKind::zero: return {};
      case NodeKind::identity: return {{Word{}, 1}};
      case NodeKind::scaled: {
        Polynomial p = expand(e.children()[0]);
        for (auto& [w, c] : p) c *= e.node().coefficient;
        return p;
      }
      case NodeKind::sum: {
        Polynomial p;
        for (const Expression& c : e.children())
          for (const auto& [w, x] : expand(c)) add(p, w, x);
        return p;
      }
      case NodeKind::product: return expand_product(e);
      case NodeKind::inverse: return expand_inverse(e);
      default: return {{Word{alphabet_.letter(e)}, 1}};
    }
  }

  Polynomial expand_product(const Expression& e) {
    Polynomial p = {{Word{}, 1}};
    for (const Expression& f : e.children()) {
      const Polynomial q = expand(f);
      Polynomial r;
      for (const auto& [w, x] : p)
        for (const auto& [u, y] : q) {
          Word joined = w;
          joined.insert(joined.end(), u.begin(), u.end());
          add(r, joined, x * y);
        }
      // Letters meet their inverses before rules open them up: reduce early only to stop growth.
      p = r.size() > 40 ? reduce(r) : r;
      if (overflow_ || p.size() > word_limit) {
        overflow_ = true;
        return {};
      }
    }
    return p;
  }

  // The inverse of a resolvent is a polynomial; of anything else a letter.
  Polynomial expand_inverse(const Expression& e) {
    const Unfolded u = unfold(e);
    if (!(u.symbol && u.inverted && u.symbol->definition->pattern == Pattern::resolvent)) return {{Word{alphabet_.letter(e)}, 1}};
    const int l = alphabet_.letter(e.children()[0]);
    Polynomial p = {{Word{}, 1}};
    const int edge = alphabet_.sibling(l, letter_code(E, u.transposed, false));
    add(p, {edge}, -1.0);
    if (u.symbol->definition->id == psi) {  // ψ⁻¹ = I - E + KH
      const int gain = alphabet_.sibling(l, letter_code(K, u.transposed, false)), hinge = alphabet_.sibling(l, letter_code(H, u.transposed, false));
      add(p, u.transposed ? Word{hinge, gain} : Word{gain, hinge}, 1.0);
    }
    return p;
  }

  static void add(Polynomial& p, const Word& w, const Coefficient& c) {
    const auto [place, fresh] = p.try_emplace(w, c);
    if (fresh) return;
    place->second += c;
    if (place->second.is_zero()) p.erase(place);
  }

  Polynomial reduce(const Polynomial& p) {
    std::deque<std::pair<Word, Coefficient>> todo(p.begin(), p.end());
    Polynomial done;
    while (!todo.empty()) {
      check_interrupt();
      if (++steps_ > step_limit || done.size() + todo.size() > word_limit) {
        overflow_ = true;
        return {};
      }
      auto [word, c] = std::move(todo.front());
      todo.pop_front();
      if (!rewrite(word, c, todo)) add(done, word, c);
    }
    return done;
  }

  // Applies the first rule that fits, leftmost; true if the word was replaced (or vanished).
  bool rewrite(const Word& word, const Coefficient& c, std::deque<std::pair<Word, Coefficient>>& todo) {
    for (int l : word)
      if (alphabet_.zero_letter(l)) return true;
    const auto replace = [&](size_t at, size_t length, const Word& with, const Coefficient& x) {
      Word w(word.begin(), word.begin() + at);
      w.insert(w.end(), with.begin(), with.end());
      w.insert(w.end(), word.begin() + at + length, word.end());
      todo.emplace_back(std::move(w), x);
    };
    for (size_t at = 0; at < word.size(); ++at) {
      if (at + 1 < word.size()) {  // A A⁻¹ = A⁻¹ A = I
        const Expression &a = alphabet_.atom(word[at]), &b = alphabet_.atom(word[at + 1]);
        if ((b.kind() == NodeKind::inverse && b.children()[0] == a) || (a.kind() == NodeKind::inverse && a.children()[0] == b)) {
          replace(at, 2, {}, c);
          return true;
        }
      }
      if (alphabet_.code(word[at]) < 0) continue;
      for (const Rule* const begins : rewrite_rules_from(alphabet_.code(word[at]))) {
        const Rule& rule = *begins;
        const size_t length = rule.from.size();
        if (at + length > word.size()) continue;
        bool fits = true;
        for (size_t i = 1; i < length && fits; ++i) fits = alphabet_.code(word[at + i]) == rule.from[i];
        for (size_t i = 1; i < length && fits; ++i) fits = same_model(word[at], word[at + i]);
        if (!fits) continue;
        for (const auto& [x, codes] : rule.to) {
          Word with;
          for (int code : codes) with.push_back(alphabet_.sibling(word[at], code));
          replace(at, length, with, c * x);
        }
        return true;
      }
    }
    return false;
  }

  bool same_model(int a, int b) const {
    const Symbol &x = *unfold(alphabet_.atom(a)).symbol, &y = *unfold(alphabet_.atom(b)).symbol;
    return x.source == y.source && x.binding == y.binding;
  }

  Alphabet& alphabet_;
  size_t steps_ = 0, visited_ = 0;
  bool overflow_ = false;
};

}  // namespace

namespace {

// How an expression in SKO letters of one model is spelled: kinds, letters and coefficients, node by node. Its normal form hangs on nothing else,
// but for whether J is zero.
using Spelling = std::vector<std::int64_t>;
constexpr size_t longest_spelling = 400;

class Speller {
 public:
  // Nothing where there are other letters, or several models.
  std::optional<Spelling> run(const Expression& e) {
    if (!spell(e) || !model) return std::nullopt;
    spelling_.push_back(model->source->traits().hinge_diagonal);
    return std::move(spelling_);
  }
  const Symbol* model = nullptr;

 private:
  bool spell(const Expression& e) {
    if (spelling_.size() > longest_spelling) return false;
    spelling_.push_back(static_cast<std::int64_t>(e.kind()));
    switch (e.kind()) {
      case NodeKind::symbol: {
        const Symbol& s = e.node().symbol;
        if (!model) model = &s;
        spelling_.push_back(static_cast<std::int64_t>(s.definition->id));
        return s.definition->kind() == LetterKind::sko && same_model(s, *model);
      }
      case NodeKind::identity: return true;
      case NodeKind::scaled:
        if (!e.node().coefficient.is_double()) return false;
        spelling_.push_back(std::bit_cast<std::int64_t>(e.node().coefficient.nearest()));
        break;
      case NodeKind::sum:
      case NodeKind::product:
      case NodeKind::transpose:
      case NodeKind::inverse: break;
      default: return false;
    }
    spelling_.push_back(static_cast<std::int64_t>(e.children().size()));
    return std::all_of(e.children().begin(), e.children().end(), [&](const Expression& c) { return spell(c); });
  }
  Spelling spelling_;
};

// Normal forms by spelling: letters in the order in which they were met, by code, and words of them.
struct Known {
  std::vector<int> codes;
  std::optional<Polynomial> form;
};
struct KnownForms {
  Mutex mutex;
  std::map<Spelling, Known> all;
};
constexpr size_t most_known = 2000;
KnownForms& known_forms() {
  static KnownForms* const instance = new KnownForms;  // never destroyed: threads may plan during the exit of the process
  return *instance;
}

// As it was found before, in the letters of this model.
std::optional<Known> recalled(const Spelling& spelling) {
  KnownForms& known = known_forms();
  const std::lock_guard<Mutex> lock(known.mutex);
  if (known.mutex.abandoned()) leave_behind(known.all);
  const auto found = known.all.find(spelling);
  if (found == known.all.end()) return std::nullopt;
  return found->second;
}

void remember(const Spelling& spelling, const Alphabet& alphabet, const std::optional<Polynomial>& form) {
  Known made{alphabet.codes(), form};
  if (std::find(made.codes.begin(), made.codes.end(), -1) != made.codes.end()) return;  // a letter that is an inverse
  KnownForms& known = known_forms();
  const std::lock_guard<Mutex> lock(known.mutex);
  if (known.mutex.abandoned()) leave_behind(known.all);
  if (known.all.size() >= most_known) known.all.clear();
  known.all.emplace(spelling, std::move(made));
}

std::optional<Polynomial> form_of(const Expression& lowered, Alphabet& alphabet) {
  Speller speller;
  const auto spelling = alphabet.codes().empty() ? speller.run(lowered) : std::nullopt;
  if (!spelling) return Normaliser(alphabet).run(lowered);
  if (auto known = recalled(*spelling)) {
    for (const int code : known->codes)
      alphabet.letter(fold(make_symbol(static_cast<SymbolId>(code / 4), speller.model->source, speller.model->binding), code & 2, code & 1));
    return std::move(known->form);
  }
  auto form = Normaliser(alphabet).run(lowered);
  remember(*spelling, alphabet, form);
  return form;
}

}  // namespace

std::optional<Polynomial> normal_form(const Expression& e, Alphabet& alphabet) {
  // Compounds other than K are abbreviations; K is a letter of the normal form.
  std::optional<Polynomial> found;
  with_stack_for(e.node().depth, [&] { found = form_of(lower(e, false), alphabet); });
  return found;
}

Expression to_expression(const Polynomial& p, const Alphabet& alphabet, const Space& domain, const Space& codomain) {
  std::vector<Expression> terms;
  for (const auto& [word, c] : p) {
    Expression term;
    if (word.empty()) {
      term = identity(domain);
    } else {
      std::vector<Expression> factors;
      for (int l : word) factors.push_back(alphabet.atom(l));
      term = product_of(std::move(factors));
    }
    terms.push_back(c == 1 ? term : c * term);
  }
  return lowered_sum(terms, domain, codomain);
}

bool equal_by_theorems(const Expression& left, const Expression& right) {
  const Expression a = left.floating() && !right.floating() ? with_space(left, right.domain()) : left;
  const Expression b = right.floating() && !left.floating() ? with_space(right, left.domain()) : right;
  Alphabet alphabet;
  const auto x = normal_form(a, alphabet);
  if (!x) return false;
  const auto y = normal_form(b, alphabet);
  if (!y || x->size() != y->size()) return false;
  for (const auto& [word, c] : *x) {
    const auto found = y->find(word);
    if (found == y->end() || found->second != c) return false;
  }
  return true;
}

}  // namespace pycraft
