#include "shading/facet_tree_body_internal.h"

namespace gewebe::shading {

double first_hit_avx2(const FacetTree& tree, const Vec3& from, const Vec3& along, double most) {
  return first_hit_of(tree, from, along, most);
}

} // namespace gewebe::shading
