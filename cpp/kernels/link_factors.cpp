#include "kernels/link_factors.h"

#include <algorithm>
#include <cmath>

#include "model/inertia_factors.h"

namespace pycraft::kernels {

namespace {

using E = Extended;

// Of a link, in its frame: mass, centre, inertia about it, and the columns and weights of that.
struct OwnInertia {
  E mass = E(0);
  Vector3<E> com = Vector3<E>::zero();
  Matrix3<E> about = Matrix3<E>::zero();
  Vector3<E> column[3]{}, dual[3]{};  // of a couple n, column r takes up (dual r · n) of itself
  E weight[3] = {E(0), E(0), E(0)}, uncertain = E(0);
};

// x -> part of x along the columns: from the last pivot to the first, as gyroscopic_bias (model/inertia_factors.h) takes them off.
void find_duals(const InertiaFactors<double>& f, OwnInertia& own) {
  for (int r = 0; r < 3; ++r) {
    own.dual[r] = Vector3<E>::zero();
    if (f.weight[3 + r] == 0) continue;
    own.dual[r][f.pivot[r]] = E(1);
    for (int s = 0; s < r; ++s) own.dual[r] = own.dual[r] - E(f.column[3 + s].angular[f.pivot[r]]) * own.dual[s];
  }
}

// Of one body its own factors, turned; of several, what they are about their common centre, in quad precision.
OwnInertia own_inertia(const MassOnLink* begin, const MassOnLink* end) {
  OwnInertia own;
  if (begin == end) return own;
  InertiaFactors<double> f;
  Matrix3<E> axes = begin->pose.R;
  if (begin + 1 == end) {
    f = inertia_factors<double>(begin->mass.mass, begin->mass.com, begin->mass.about_com);
    own.mass = E(begin->mass.mass);
    own.com = begin->pose.p + begin->pose.R * cast<E>(begin->mass.com);
  } else {
    axes = Matrix3<E>::identity();
    Quad mass(0);
    Vector3<Quad> moment = Vector3<Quad>::zero();
    const auto centre = [](const MassOnLink& one) { return cast<Quad>(one.pose.p) + cast<Quad>(one.pose.R) * cast<Quad>(one.mass.com); };
    for (const MassOnLink* one = begin; one != end; ++one) mass += Quad(one->mass.mass), moment = moment + Quad(one->mass.mass) * centre(*one);
    const Vector3<Quad> com = (mass > Quad(0) ? Quad(Quad(1) / mass) : Quad(0)) * moment;
    Symmetric3<Quad> I = Symmetric3<Quad>::zero();
    for (const MassOnLink* one = begin; one != end; ++one) {
      const Vector3<Quad> off = centre(*one) - com;
      I = I + rotate(cast<Quad>(one->pose.R), cast<Quad>(one->mass.about_com));
      const Symmetric3<Quad> point = point_inertia(off);
      for (int i = 0; i < 6; ++i) I.s[i] += Quad(one->mass.mass) * point.s[i];
    }
    Quad full[9];
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) full[3 * i + j] = I(i, j);
    factor_moments(full, f);
    own.mass = static_cast<E>(mass), own.com = cast<E>(com);
  }
  find_duals(f, own);
  own.uncertain = E(f.uncertain);
  for (int r = 0; r < 3; ++r) {
    own.weight[r] = E(f.weight[3 + r]);
    own.column[r] = axes * cast<E>(f.column[3 + r].angular), own.dual[r] = axes * own.dual[r];
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) own.about(i, j) += own.weight[r] * own.column[r][i] * own.column[r][j];
  }
  return own;
}

// The order of rows (factored_columns.h), and whether the hinge's stands by itself.
template <class T>
void order_rows(const Link<T>& link, LinkFactors<T>& own) {
  own.kept = link.rotor || (link.step == Step::helix && link.turn != T(0));
  int order[6] = {0, 1, 2, 3, 4, 5};  // n, then f
  if (link.step < Step::turned_pin) {
    const int K = static_cast<int>(link.step), i = (K + 1) % 3, j = (K + 2) % 3;
    const int alone[6] = {K, 3 + i, 3 + j, 3 + K, i, j}, beside[6] = {3 + i, 3 + j, 3 + K, K, i, j};
    std::copy_n(own.kept ? beside : alone, 6, order);
  } else if (link.step == Step::turned_pin) {
    for (int i = 0; i < 3; ++i) order[i] = (2 + i) % 3;
  } else if (link.step == Step::helix && !own.kept) {
    const int slides[6] = {5, 0, 1, 2, 3, 4};
    std::copy_n(slides, 6, order);
  }
  for (int i = 0; i < 6; ++i) own.row[order[i]] = i + own.kept;
}

template <class T>
void put(const OwnInertia& of, bool roots, LinkFactors<T>& own) {
  using std::sqrt;
  const auto scale = [&](const E& weight) { return roots ? E(sqrt(weight)) : E(1); };
  const auto place = [&](int column, int row) -> T& { return own.own[((column + 2) / 4 * 9 + row) * 4 + (column + 2) % 4]; };
  own.empty = of.mass == E(0) && of.weight[0] == E(0);
  own.whole = of.weight[2] > E(0);
  std::fill_n(own.own, 72, T(0));
  own.mass_root = static_cast<T>(scale(of.mass));
  Matrix3<E> left = Matrix3<E>::identity();
  for (int c = 0; c < 3; ++c) {
    own.com[c] = static_cast<T>(of.com[c]);
    Vector3<E> e = Vector3<E>::zero();
    e[c] = scale(of.mass);
    const Vector3<E> moment = cross(of.com, e);
    const E of_column = scale(of.weight[c]), taken = of.weight[c] > E(0) ? E(of_column / of.weight[c]) : E(0);
    for (int i = 0; i < 3; ++i) {
      place(c, own.row[i]) = static_cast<T>(moment[i]), place(c, own.row[3 + i]) = static_cast<T>(e[i]);
      place(3 + c, own.row[i]) = static_cast<T>(of_column * of.column[c][i]);
      own.acceleration[3 * c + i] = static_cast<T>(-taken * of.dual[c][i]);
      for (int j = 0; j < 3; ++j) left(i, j) -= of.column[c][i] * of.dual[c][j];
    }
    place(c, 8) = static_cast<T>(roots ? E(1) : of.mass), place(3 + c, 8) = static_cast<T>(roots ? E(1) : of.weight[c]);
  }
  for (int i = 0; i < 3; ++i)
    for (int j = i, at = i == 0 ? 0 : i == 1 ? 3 : 5; j < 3; ++j) own.about[at + j - i] = static_cast<T>(of.about(i, j));
  for (int i = 0; i < 9; ++i) own.left[i] = static_cast<T>(left.m[i]);
}

// Where columns are: three fours of what follows a link and its own, two more for each other link that hangs on it, and a rotor's in a place that is
// left, or one four more. A tip is without the first, and what has no mass without the third.
template <class T>
int make_room(const std::vector<Link<T>>& links, std::vector<LinkFactors<T>>& own) {
  const int count = static_cast<int>(links.size());
  std::vector<int> others(count, 0);
  const auto follows = [&](int k) { return links[k].parent == k - 1; };
  for (int k = 0; k < count; ++k)
    if (links[k].parent >= 0 && !follows(k)) ++others[links[k].parent];
  int fours = 0;
  for (int k = 0; k < count; ++k) {
    const bool tip = k + 1 == count || !follows(k + 1), full = !tip && own[k + 1].kept;
    own[k].rotor = !links[k].rotor ? -1 : tip ? 4 : links[k].branches ? 18 : own[k].empty ? 6 : full ? 12 : 5;
    own[k].fours = tip || (own[k].empty && !links[k].branches) ? 2 : 3 + 2 * others[k] + (own[k].rotor == 12);
    own[k].room = links[k].branches ? fours : -1;
    if (links[k].branches) fours += own[k].fours;
    own[k].to = links[k].parent >= 0 && !follows(k) ? own[links[k].parent].room + 3 + 2 * --others[links[k].parent] : -1;
  }
  return fours;
}

}  // namespace

template <class T>
FactoredLinks<T> factored_links(const std::vector<Link<T>>& links, std::vector<MassOnLink> masses) {
  FactoredLinks<T> made;
  const int count = static_cast<int>(links.size());
  std::erase_if(masses, [](const MassOnLink& one) { return one.mass.mass == 0 && one.mass.about_com.s[0] + one.mass.about_com.s[3] + one.mass.about_com.s[5] == 0; });
  std::stable_sort(masses.begin(), masses.end(), [](const MassOnLink& a, const MassOnLink& b) { return a.link < b.link; });
  std::vector<OwnInertia> inertias;
  const MassOnLink* at = masses.data();
  const MassOnLink* const end = at + masses.size();
  for (int k = 0; k < count; ++k) {
    const MassOnLink* const first = at;
    while (at != end && at->link == k) ++at;
    inertias.push_back(own_inertia(first, at));
  }
  for (int form = 0; form < 2; ++form) {
    std::vector<LinkFactors<T>>& own = made.forms[form];
    own.resize(count);
    for (int k = 0; k < count; ++k) order_rows(links[k], own[k]), put(inertias[k], form == 1, own[k]);
    made.fours = make_room(links, own);
  }
  for (int k = count - 1; k >= 0; --k) {
    for (auto& own : made.forms) own[k].uncertain = static_cast<T>(inertias[k].uncertain);
    if (const int p = links[k].parent; p >= 0) inertias[p].uncertain += inertias[k].uncertain;
  }
  return made;
}

template FactoredLinks<float> factored_links(const std::vector<Link<float>>&, std::vector<MassOnLink>);
template FactoredLinks<double> factored_links(const std::vector<Link<double>>&, std::vector<MassOnLink>);

}  // namespace pycraft::kernels
