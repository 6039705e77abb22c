#include "raster/raster_rest_internal.h"

#include "base/error.h"

namespace gewebe::raster {

RasterRest::RasterRest(const shading::Drawing& drawing, const texture::SurfaceMaterial& material,
                       KernelScene& scene) {
  if (!texture::is_at_rest(material) || drawing.vertices.empty())
    return;
  static_assert(sizeof(texture::DrawRest) == 6 * sizeof(float) &&
                sizeof(texture::DrawTurn) == 6 * sizeof(float));
  if (drawing.rests.size() != drawing.vertices.size())
    throw Error("textures on the shape at rest for a drawing without it, expected its places");
  rest_.vertices = reinterpret_cast<const float*>(drawing.rests.data());
  if (!drawing.turns.empty())
    rest_.turns = reinterpret_cast<const float*>(drawing.turns.data());
  const auto image = [&](const std::optional<texture::Texture>& texture,
                         const KernelTexture*& there, KernelRestLayer& layer) {
    if (!texture::is_triplanar(material, texture))
      return;
    layer.image = there;
    rest_.normals = true;
    rest_.derivatives = rest_.derivatives || there->count > 1;
    there = nullptr;
  };
  image(material.base, scene.textures.base, rest_.base);
  image(material.detail, scene.textures.detail, rest_.detail);
  image(material.reflection, scene.textures.reflection, rest_.reflection);
  image(material.structure, scene.textures.structure, rest_.structure);
  const auto solid = [&](const std::optional<texture::SolidTexture>& texture,
                         std::optional<texture::SolidPlan>& plan, KernelRestLayer& layer) {
    if (!texture)
      return;
    plan = texture::solid_plan(*texture, drawing.rest_origin, drawing.rest_scale);
    layer.solid = &*plan;
    rest_.derivatives = rest_.derivatives || texture->filtered;
  };
  solid(material.solid_base, base_, rest_.base);
  solid(material.solid_detail, detail_, rest_.detail);
  solid(material.solid_structure, structure_, rest_.structure);
  rest_.normals = rest_.normals || material.solid_structure;
  rest_.scale = static_cast<float>(drawing.rest_scale / material.rest.edge);
  const Vec3 part = (drawing.rest_origin - material.rest.start) / material.rest.edge;
  for (int a = 0; a < 3; ++a)
    rest_.part[a] = static_cast<float>(part[a]);
  rest_.sharpness = material.rest.sharpness;
  rest_.shift = static_cast<float>(drawing.offset[0] * material.rest.edge / drawing.rest_scale);
  scene.rest = &rest_;
}

} // namespace gewebe::raster
