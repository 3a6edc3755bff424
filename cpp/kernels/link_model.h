// The links of a model: hinges taken apart into subhinges, welded bodies joined to what carries them, frames laid so that the axis of a pin,
// slider or screw is a coordinate axis through the link's origin.
//
// Where a hinge's axis is a coordinate axis of its parent link to 8 eps (what the rotations of poses are rounded by, in doubles or in wider
// numbers), it is taken for it, and the link's axes are the parent's at rest; else the link is turned so that the axis becomes z. Poses and
// inertias are carried to the new frames in extended precision, of wide numbers in quad, and rounded once.
#pragma once

#include <memory>
#include <vector>

#include "kernels/link_factors.h"
#include "kernels/links.h"
#include "kernels/tree_parts.h"
#include "model/hinge_terms.h"
#include "model/multibody.h"

namespace pycraft::kernels {

template <class T>
class LinkModel {
 public:
  // Nothing where a hinge is not one of those that kernels know: a rotor on a ball or a free hinge, or three sliders that carry a body along
  // and stand behind another subhinge, whose own terms only the general recursions keep from masses.
  static std::unique_ptr<LinkModel> of(const Multibody& model, const HingeTerms& terms = {});

  const Links<T>& links() const { return links_; }
  // The links' inertias in factors, which only calls in factored forms ask for, in single and double precision.
  void find_factors();
  // For threads; none where the tree is small or does not branch into large ones.
  const std::vector<TreePart>& parts() const { return parts_; }
  size_t bodies() const { return bodies_.size(); }
  OnLink<T> on_link(const Node& node) const;
  // (n; f) on every body, in its frame, as those on links.
  void wrenches_on_links(const Vector6<T>* on_bodies, std::vector<T>& out) const;
  // The same of one body: its link, -1: of the base, and what is added there to (n; f).
  int link_carrying(int body) const { return bodies_[body].link; }
  Vector6<T> on_its_link(int body, const Vector6<T>& wrench) const { return force_to_parent(bodies_[body].pose, wrench); }
  // J where links were made for it (HingeTerms::driven), added to what it was, from numbers of all coordinates.
  void add_to_hinges(const double* inertia);

 private:
  struct Carried {  // where a body is part of a link
    int link;       // -1: of the base
    Pose<T> pose;
  };
  static constexpr bool has_factors = std::is_same_v<T, float> || std::is_same_v<T, double>;
  template <class Rest>
  void take(const std::vector<Rest>& rest);

  Links<T> links_{};
  std::vector<Link<T>> all_;
  std::vector<MassOnLink> masses_;
  FactoredLinks<T> factored_;
  std::vector<TreePart> parts_;
  std::vector<double> wide_masses_;
  std::vector<Carried> bodies_;
  std::vector<T> inertia_;  // J of links as they were made
};

extern template class LinkModel<float>;
extern template class LinkModel<double>;
extern template class LinkModel<Extended>;
extern template class LinkModel<Quad>;

}  // namespace pycraft::kernels
