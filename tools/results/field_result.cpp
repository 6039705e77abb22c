#include "tools/results/field_result.h"

#include "base/error.h"
#include "formats/volume/grey_volume.h"
#include "formats/volume/nifti_field.h"
#include "tetrahedra/lattice_field.h"

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

namespace gewebe::cli {
namespace {

/// A solid at rest, and where its nodes went.
struct Solid {
  tetrahedra::TetMesh mesh;
  std::vector<Vec3> displacement;
};

class FieldResult final : public formats::ResultWriter {
public:
  FieldResult(const std::string& path, const formats::Output::Options& output, FieldOptions options,
              const Context& context)
      : options_(std::move(options)), context_(context), output_(path, output),
        gzip_(path.ends_with(".gz")) {
    formats::Input image(options_.like, false);
    formats::VolumePlace place = formats::read_volume_place(image, context);
    for (const std::string& warning : place.warnings)
      options_.warn(warning);
    size_ = place.size;
    transform_ = place.transform;
    at(image.name(), [&] {
      for (const std::int32_t n : size_)
        if (n > formats::nifti_longest)
          throw Error(std::to_string(n) + " voxels along an axis, expected up to " +
                      std::to_string(formats::nifti_longest) + " for NIfTI");
      require_memory(context, 13.0 * size_[0] * static_cast<double>(size_[1]) * size_[2],
                     "the displacement field");
    });
  }

  void add_object(const std::string& name, const model::Model& model) override {
    solids_.push_back(solid_of(name, model));
    names_.push_back(name);
  }

  void change_object(std::size_t object, const model::Model& model,
                     std::span<const std::uint32_t> /*origin*/) override {
    solids_.at(object) = solid_of(names_.at(object), model);
  }

  void add_frame(double time, std::span<const formats::FrameObject> objects) override {
    ++frames_;
    time_ = time;
    for (std::size_t n = 0; n < objects.size(); ++n) {
      const std::span<const double> from = objects[n].displacement;
      std::vector<Vec3>& to = solids_.at(n).displacement;
      to.resize(from.size() / 3);
      for (std::size_t p = 0; p < to.size(); ++p)
        to[p] = {from[3 * p], from[3 * p + 1], from[3 * p + 2]};
    }
  }

  void commit() override {
    write();
    output_.commit();
  }

  std::optional<formats::KeptResult> keep_partial(const std::string& /*why*/) override {
    if (frames_ < 2 || !output_.has_temporary())
      return std::nullopt;
    output_.start_over();
    context_.cancelled = nullptr; // by the end of the run
    write();
    return formats::KeptResult{"the field", time_, false, "", output_.commit_partial()};
  }

private:
  void write() {
    const tetrahedra::PlaceLattice lattice = formats::voxel_centres(size_, transform_);
    tetrahedra::LatticeField field(lattice.places());
    for (Solid solid : solids_) {
      solid.displacement.resize(solid.mesh.points.size()); // it came behind the last frame
      if (!options_.at_rest)
        for (std::size_t p = 0; p < solid.mesh.points.size(); ++p) {
          solid.mesh.points[p] = solid.mesh.points[p] + solid.displacement[p];
          solid.displacement[p] = solid.displacement[p] * -1.0;
        }
      tetrahedra::interpolate_on_lattice(solid.mesh, solid.displacement, lattice, field, context_);
    }
    formats::write_nifti_field(field, size_, transform_, options_.outside,
                               options_.at_rest ? "gewebe: displacement from rest, LPS mm"
                                                : "gewebe: displacement back to rest, LPS mm",
                               gzip_, [&](std::string_view bytes) { output_.write(bytes); });
  }

  static Solid solid_of(const std::string& name, const model::Model& model) {
    if (model.tetrahedra.empty())
      throw Error(name, "has no tetrahedra, expected solids alone for a displacement field");
    Solid solid;
    solid.mesh.points.reserve(model.nodes.size());
    for (const model::Node& node : model.nodes)
      solid.mesh.points.push_back(node.position);
    solid.mesh.tetrahedra = model.tetrahedra;
    solid.mesh.middles = model.middles;
    return solid;
  }

  FieldOptions options_;
  Context context_;
  formats::Output output_;
  bool gzip_;
  Int3 size_{};
  volume::GridTransform transform_;
  std::vector<Solid> solids_;
  std::vector<std::string> names_;
  std::uint64_t frames_ = 0;
  double time_ = 0;
};

} // namespace

std::unique_ptr<formats::ResultWriter> open_field_result(const std::string& path,
                                                         const formats::Output::Options& output,
                                                         const FieldOptions& options,
                                                         const Context& context) {
  return std::make_unique<FieldResult>(path, output, options, context);
}

} // namespace gewebe::cli
