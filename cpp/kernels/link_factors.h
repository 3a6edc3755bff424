// The inertias of a model's links in factors: LinkFactors of links.h, from the masses that its bodies were given.
#pragma once

#include <vector>

#include "kernels/links.h"
#include "numerics/scalar.h"
#include "spatial/rigid_inertia.h"

namespace pycraft::kernels {

// A body's mass as part of a link.
struct MassOnLink {
  int link;
  Pose<Extended> pose;
  MassProperties mass;
};

template <class T>
struct FactoredLinks {
  std::vector<LinkFactors<T>> forms[2];  // ud, square root
  int fours = 0;
};

template <class T>
FactoredLinks<T> factored_links(const std::vector<Link<T>>& links, std::vector<MassOnLink> masses);

extern template FactoredLinks<float> factored_links(const std::vector<Link<float>>&, std::vector<MassOnLink>);
extern template FactoredLinks<double> factored_links(const std::vector<Link<double>>&, std::vector<MassOnLink>);

}  // namespace pycraft::kernels
