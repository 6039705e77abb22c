#pragma once
// Which elements the points of a cut skin follow: those on their side of the wound.

#include "cutting/cut_skin.h"
#include "incision/cut_tetrahedra.h"
#include "model/model.h"

#include <cstdint>
#include <span>
#include <vector>

namespace gewebe::cutting {

/// Of each element: 1 near the wall above it, -1 below, 0 elsewhere and where both are as near, as
/// at a front; in steps from face to face, `steps` at most.
std::vector<std::int8_t> sides_of_elements(const model::Model& model,
                                           std::span<const incision::WallTriangle> wall,
                                           double reach, int steps);

/// What of a sheet lies in, or nearest to, elements with an edge of the wall.
SkinSheet sheet_beside(const model::Model& model, std::span<const incision::WallTriangle> wall,
                       const SkinSheet& sheet);

/// Gives each point an element: of those that are fresh, whose element has changed, or stands on
/// the other side, the nearest one that does not stand on the other side. Triangles of walls get
/// the material of the element that their first corner follows; where four fifths of what the curve
/// encloses are of one material, all of it is; inside an inner surface they get that surface's.
/// \param elements sides_of_elements()  \param changed elements, ascending
/// \pre model.skin is the cut's, model.tetrahedra are those after the cut
void bind_skin(model::Model& model, const SkinCut& cut, std::span<const std::int8_t> elements,
               std::span<const std::uint32_t> changed);

} // namespace gewebe::cutting
