#include "simulation/selection.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <string>
#include <unordered_map>

#include "model/checks.h"
#include "runtime/errors.h"

namespace pycraft {

namespace {

// Letters to be put in, left out or exchanged to make b of a.
size_t distance(const std::string& a, const std::string& b) {
  std::vector<size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), size_t(0));
  for (size_t i = 0; i < a.size(); ++i) {
    size_t diagonal = row[0]++;
    for (size_t j = 0; j < b.size(); ++j) {
      const size_t kept = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({kept, row[j] + 1, diagonal + 1});
    }
  }
  return row.back();
}

bool is_pattern(const std::string& name) { return name.find_first_of("*?[") != std::string::npos; }

[[noreturn]] void throw_not_there(const std::string& effect, const std::string& what, const std::string& name, const Multibody& model, const std::vector<std::string>& known) {
  std::string text = effect + ": no " + what + " of '" + model.name() + "' ";
  if (is_pattern(name))
    text += "fits '" + name + "'";
  else
    text += "is called '" + name + "'";
  const auto near = nearest_names(name, known);
  for (size_t i = 0; i < near.size(); ++i) text += (i == 0 ? "; did you mean '" : i + 1 == near.size() ? " or '" : ", '") + near[i] + "'";
  throw ModelError(text + (near.empty() ? "; there is none" : "?"));
}

[[noreturn]] void throw_without_coordinates(const std::string& effect, const std::string& hinge) {
  throw ModelError(effect + ": hinge '" + hinge + "' has no coordinates, it is locked or a weld: unlock it where it was locked, unlock('" + hinge + "'), or leave it out");
}

// From which coordinate to which, by names of coordinates and of hinges, which go before.
std::unordered_map<std::string, std::pair<int, int>> coordinate_numbers(const Multibody& model) {
  std::unordered_map<std::string, std::pair<int, int>> numbers;
  const std::vector<std::string> names = model.structure().coordinate_names;
  for (int j = 0; j < model.nv(); ++j) numbers[names[j]] = {j, j + 1};
  for (int k = 0; k < model.bodies(); ++k) numbers[model.body(k).hinge.name] = {model.v_offset(k), model.v_offset(k + 1)};
  return numbers;
}

// Where the body of a name is meant and its hinge is called otherwise.
std::string moved_by(const Multibody& model, const std::string& name) {
  for (int k = 0; k < model.bodies(); ++k)
    if (model.body(k).name == name) return "; body '" + name + "' is moved by hinge '" + model.body(k).hinge.name + "'";
  return "";
}

}  // namespace

std::vector<std::string> nearest_names(const std::string& name, const std::vector<std::string>& known, size_t most) {
  std::vector<std::pair<size_t, std::string>> all;
  for (const std::string& k : known)
    if (k.size() < 200 && name.size() < 200) all.emplace_back(distance(name, k), k);
  std::stable_sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<std::string> near;
  for (size_t i = 0; i < std::min(most, all.size()); ++i) near.push_back(all[i].second);
  return near;
}

namespace {

// Letters of a text in UTF-8: bytes that are none stand for themselves.
std::u32string letters(const std::string& text) {
  std::u32string all;
  for (size_t i = 0; i < text.size();) {
    const auto byte = [&](size_t at) { return static_cast<unsigned char>(text[at]); };
    const int more = byte(i) >= 0xf0 ? 3 : byte(i) >= 0xe0 ? 2 : byte(i) >= 0xc0 ? 1 : 0;
    char32_t letter = more == 0 ? byte(i) : byte(i) & (0x3f >> more);
    size_t end = i + 1;
    for (; end <= i + more && end < text.size() && (byte(end) & 0xc0) == 0x80; ++end) letter = letter << 6 | (byte(end) & 0x3f);
    all += letter, i = end;
  }
  return all;
}

// Whether a letter is one of the set that begins at pattern[at], "[abc]", "[a-c]", "[!abc]"; at moves past it. A "]" that comes first is a letter.
// Nothing where no "]" ends it.
std::optional<bool> in_set(char32_t letter, const std::u32string& pattern, size_t& at) {
  const bool none = at + 1 < pattern.size() && pattern[at + 1] == U'!';
  const size_t first = at + 1 + none, end = pattern.find(U']', first + 1);
  if (end == std::u32string::npos) return std::nullopt;
  bool found = false;
  for (size_t i = first; i < end; ++i) {
    const bool range = i + 2 < end && pattern[i + 1] == U'-';
    found |= range ? pattern[i] <= letter && letter <= pattern[i + 2] : pattern[i] == letter;
    if (range) i += 2;
  }
  at = end + 1;
  return found != none;
}

}  // namespace

bool fits_pattern(const std::string& called, const std::string& shape) {
  const std::u32string name = letters(called), pattern = letters(shape);
  size_t n = 0, p = 0, star = std::u32string::npos, from = 0;
  const auto fits_one = [&](size_t& at) {  // the part of the pattern at `at` against one letter; at moves past it
    if (pattern[at] == U'?') return ++at, true;
    if (pattern[at] == U'[')
      if (const std::optional<bool> fits = in_set(name[n], pattern, at)) return *fits;
    return pattern[at++] == name[n];
  };
  while (n < name.size()) {
    size_t next = p;
    if (p < pattern.size() && pattern[p] == U'*') {
      star = p++, from = n;
    } else if (p < pattern.size() && fits_one(next)) {
      p = next, ++n;
    } else if (star != std::u32string::npos) {
      p = star + 1, n = ++from;
    } else {
      return false;
    }
  }
  while (p < pattern.size() && pattern[p] == U'*') ++p;
  return p == pattern.size();
}

std::vector<int> coordinates_named(const Multibody& model, const Names& names, const std::string& effect, bool welds_too) {
  std::vector<int> found;
  if (!names) {
    found.resize(model.nv());
    std::iota(found.begin(), found.end(), 0);
    return found;
  }
  std::vector<char> there(model.nv());
  const auto add = [&](int from, int to) {
    for (int j = from; j < to; ++j)
      if (!there[j]) there[j] = 1, found.push_back(j);
  };
  const auto numbers = coordinate_numbers(model);
  for (const std::string& name : *names) {
    if (const auto exact = numbers.find(name); exact != numbers.end()) {
      if (!welds_too && exact->second.first == exact->second.second) throw_without_coordinates(effect, name);
      add(exact->second.first, exact->second.second);
      continue;
    }
    std::vector<std::pair<int, int>> fitting;
    if (is_pattern(name))
      for (const auto& [known, range] : numbers)
        if (fits_pattern(known, name)) fitting.push_back(range);
    std::sort(fitting.begin(), fitting.end());
    for (const auto& [from, to] : fitting) add(from, to);
    if (!fitting.empty()) continue;
    // A coordinate, "elbow[1]", of a hinge that has none now.
    if (const auto hinge = numbers.find(name.substr(0, name.rfind('['))); hinge != numbers.end() && hinge->second.first == hinge->second.second)
      throw_without_coordinates(effect, hinge->first);
    if (const std::string text = moved_by(model, name); !text.empty()) throw ModelError(effect + ": no hinge of '" + model.name() + "' is called '" + name + "'" + text);
    std::vector<std::string> known;
    for (const auto& [other, _] : numbers) known.push_back(other);
    std::sort(known.begin(), known.end());
    throw_not_there(effect, "hinge or coordinate", name, model, known);
  }
  return found;
}

std::vector<int> hinges_named(const Multibody& model, const Names& names, const std::string& effect) {
  std::vector<int> found;
  std::vector<char> wanted(model.nv());
  for (int j : coordinates_named(model, names, effect)) wanted[j] = 1;
  for (int k = 0; k < model.bodies(); ++k) {
    const auto from = wanted.begin() + model.v_offset(k), to = wanted.begin() + model.v_offset(k + 1);
    if (std::find(from, to, 1) != to) found.push_back(k);
  }
  return found;
}

std::vector<int> bodies_named(const Multibody& model, const Names& names, const std::string& effect) {
  std::vector<int> found;
  std::vector<char> there(model.bodies(), !names);
  std::unordered_map<std::string, int> numbers;
  for (int k = 0; k < model.bodies(); ++k) numbers[model.body(k).name] = k;
  for (const std::string& name : names.value_or(std::vector<std::string>())) {
    bool fits = false;
    if (const auto exact = numbers.find(name); exact != numbers.end())
      there[exact->second] = 1, fits = true;
    else if (is_pattern(name))
      for (const auto& [known, k] : numbers)
        if (fits_pattern(known, name)) there[k] = 1, fits = true;
    if (fits) continue;
    std::vector<std::string> known;
    for (const auto& [other, _] : numbers) known.push_back(other);
    std::sort(known.begin(), known.end());
    throw_not_there(effect, "body", name, model, known);
  }
  for (int k = 0; k < model.bodies(); ++k)
    if (there[k]) found.push_back(k);
  return found;
}

Node node_named(const Multibody& model, const std::string& name, const std::string& effect) {
  if (name.empty()) return {"", -1, Pose<double>::identity()};
  for (const Node& n : model.nodes())
    if (n.name == name) return n;
  for (int k = 0; k < model.bodies(); ++k)
    if (model.body(k).name == name) return {name, k, Pose<double>::identity()};
  std::vector<std::string> known;
  for (const Node& n : model.nodes()) known.push_back(n.name);
  for (int k = 0; k < model.bodies(); ++k) known.push_back(model.body(k).name);
  throw_not_there(effect, "node or body", name, model, known);
}

std::vector<double> for_each(std::vector<double> values, size_t count, const std::string& what) {
  for (double x : values)
    if (!std::isfinite(x)) throw ModelError(what + " has an entry that is " + short_number(x));
  if (values.size() == 1) return std::vector<double>(count, values[0]);
  if (values.size() != count)
    throw ModelError(what + " takes one number, or one for each of its " + std::to_string(count) + " coordinates, not " + std::to_string(values.size()));
  return values;
}

std::vector<double> not_negative(std::vector<double> values, size_t count, const std::string& what) {
  values = for_each(std::move(values), count, what);
  for (double x : values)
    if (x < 0) throw ModelError(what + " is " + short_number(x) + "; it is not negative");
  return values;
}

SubhingePlace subhinge_of_coordinate(const Multibody& model, int coordinate) {
  int k = 0, end = model.bodies();  // the last body whose coordinates begin at this one or before
  while (end - k > 1) {
    const int middle = k + (end - k) / 2;
    (model.v_offset(middle) <= coordinate ? k : end) = middle;
  }
  int q = model.q_offset(k), v = model.v_offset(k), i = 0;
  for (const Subhinge& s : model.body(k).hinge.subhinges) {
    if (coordinate < v + s.nv()) return {k, i, s.kind, q, v};
    q += s.nq(), v += s.nv(), ++i;
  }
  throw ModelError("coordinate " + std::to_string(coordinate) + " of '" + model.name() + "' is not there");
}

std::vector<SingleCoordinate> single_coordinates(const Multibody& model, const Names& hinges, const std::string& effect) {
  const std::vector<std::string> names = model.structure().coordinate_names;
  std::vector<SingleCoordinate> found;
  for (const int j : coordinates_named(model, hinges, effect)) {
    const SubhingePlace at = subhinge_of_coordinate(model, j);
    const SubhingeRecord& record = record_of(at.kind);
    if (record.nq == 1)
      found.push_back({at.q, at.v});
    else if (hinges)
      throw ModelError(effect + ": coordinate '" + names[j] + "' is one of a " + record.name + " subhinge; it acts on pins, sliders and screws");
  }
  return found;
}

}  // namespace pycraft
