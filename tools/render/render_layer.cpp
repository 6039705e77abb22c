#include "tools/render/render_layer.h"

#include "formats/image/image_file.h"

namespace gewebe::cli {
namespace {

void refuse(bool wrong, const std::string& what) {
  if (wrong)
    throw UsageError(what);
}

/// "noise" and "veins", which are no files.
void complete_solid(const std::string& word, RenderLayer& layer) {
  if (!texture::is_solid_texture(layer.path))
    return;
  const std::string option = "--" + word;
  refuse(option == "--reflection",
         "--reflection: '" + layer.path + "' is no picture of the surroundings, expected a file");
  refuse(layer.options.sphere, "--sphere: " + word + " is solid, expected a texture from a file");
  try {
    layer.solid = texture::solid_texture_from_text(layer.path);
  } catch (const Error& error) {
    throw UsageError(option + ": " + error.what());
  }
  refuse(option == "--structure" && (layer.path.find("ground=") != std::string::npos ||
                                     layer.path.find("color=") != std::string::npos),
         "--structure: heights have no colour, expected neither ground nor color");
  layer.solid->filtered = layer.options.filter == texture::TextureFilter::mipmap;
}

void take(std::optional<texture::Texture>& image, std::optional<texture::SolidTexture>& solid,
          const RenderLayer& layer, const Context& context) {
  if (layer.path.empty())
    return;
  image.reset();
  solid = layer.solid;
  if (solid)
    return;
  formats::Input input(layer.path);
  image = texture::texture_from(formats::read_image(input, context), layer.options);
}

} // namespace

void complete_layer(RenderArguments& a, const std::string& word, RenderLayer& layer) {
  if (layer.path.empty())
    return;
  complete_solid(word, layer);
  shading::DrawingOptions& drawing = a.drawing;
  const bool structure = word == "structure";
  if (layer.solid || (a.words.uv == "triplanar" && !layer.options.sphere)) {
    drawing.rest = true;
    drawing.rest_normals = drawing.rest_normals || !layer.solid || structure;
    drawing.rest_light = drawing.rest_light || structure;
    a.common.rest.triplanar = a.common.rest.triplanar || !layer.solid;
    return;
  }
  (layer.options.sphere ? drawing.sphere : drawing.texcoords) = true;
  drawing.structure = drawing.structure || structure;
  drawing.texcoords = drawing.texcoords || structure;
}

void take_textures(texture::SurfaceMaterial& material, const RenderLayers& layers,
                   const Context& context) {
  const auto& [base, detail, reflection, structure] = layers;
  take(material.base, material.solid_base, *base, context);
  take(material.detail, material.solid_detail, *detail, context);
  if (!reflection->path.empty()) {
    formats::Input input(reflection->path);
    material.reflection =
        texture::texture_from(formats::read_image(input, context), reflection->options);
  }
  if (structure->path.empty())
    return;
  material.structure.reset();
  material.solid_structure = structure->solid;
  if (material.solid_structure)
    return;
  formats::Input input(structure->path);
  material.structure =
      texture::texture_from(formats::read_heights(input, context), structure->options);
}

} // namespace gewebe::cli
