#include "formats/results/results_mesh.h"

#include "base/error.h"
#include "embedding/skin.h"
#include "formats/mesh/obj_stl.h"
#include "formats/mesh/ply.h"
#include "formats/results/series_internal.h"

#include <algorithm>
#include <optional>
#include <utility>

namespace gewebe::formats {

namespace {

/// All surfaces in one mesh; each is a part where there are several.
class Shapes {
public:
  void add(const model::Model& model) {
    surfaces_.push_back(model::shown_mesh(model));
    skins_.push_back(embedding::skin_weights(model));
    last_.emplace_back(3 * model.nodes.size());
  }
  void change(std::size_t object, const model::Model& model) {
    surfaces_.at(object) = model::shown_mesh(model);
    skins_[object] = embedding::skin_weights(model);
    last_[object].assign(3 * model.nodes.size(), 0);
  }
  void set(std::span<const FrameObject> objects) {
    for (std::size_t i = 0; i < objects.size(); ++i)
      last_[i].assign(objects[i].displacement.begin(), objects[i].displacement.end());
  }
  void write(Kind kind, Output& output) const {
    const TriangleMesh mesh = joined();
    const auto sink = [&](std::string_view bytes) { output.write(bytes); };
    gewebe::at(output.name(), [&] {
      check_mesh(mesh);
      if (kind == Kind::ply)
        write_ply(mesh, sink);
      else
        write_obj(mesh, sink);
    });
  }

private:
  TriangleMesh joined() const {
    TriangleMesh all;
    bool textured = false;
    for (const TriangleMesh& surface : surfaces_)
      textured = textured || !surface.texcoords.empty();
    for (std::size_t k = 0; k < surfaces_.size(); ++k) {
      TriangleMesh mesh = surfaces_[k];
      const auto shift = static_cast<std::uint32_t>(all.points.size());
      if (all.points.size() + mesh.points.size() > UINT32_MAX)
        throw Error("the objects have over 2^32 nodes, expected fewer");
      if (!skins_[k].node.empty())
        mesh.points = embedding::displaced_skin(skins_[k], mesh.points, last_[k]);
      else
        for (std::size_t i = 0; i < mesh.points.size(); ++i)
          mesh.points[i] += Vec3{last_[k][3 * i], last_[k][3 * i + 1], last_[k][3 * i + 2]};
      all.points.insert(all.points.end(), mesh.points.begin(), mesh.points.end());
      for (const Triangle& t : mesh.triangles)
        all.triangles.push_back({t[0] + shift, t[1] + shift, t[2] + shift});
      mesh.texcoords.resize(textured ? mesh.triangles.size() : 0);
      all.texcoords.insert(all.texcoords.end(), mesh.texcoords.begin(), mesh.texcoords.end());
      if (surfaces_.size() > 1)
        all.part.insert(all.part.end(), mesh.triangles.size(), static_cast<std::int32_t>(k));
      else
        all.material = std::move(mesh.material);
    }
    return all;
  }

  std::vector<TriangleMesh> surfaces_;
  std::vector<embedding::SkinWeights> skins_;
  std::vector<std::vector<double>> last_;
};

/// The shapes of the last frame, or of each in a file of its own.
class ShapeWriter final : public ResultWriter {
public:
  ShapeWriter(Kind kind, const std::string& path, const Output::Options& options)
      : kind_(kind), path_(path), options_(options), pattern_(series_in(path)) {
    if (!pattern_)
      last_.emplace(path, options);
  }

  void add_object(const std::string& /*name*/, const model::Model& model) override {
    shapes_.add(model);
  }
  void change_object(std::size_t object, const model::Model& model,
                     std::span<const std::uint32_t> /*origin*/) override {
    shapes_.change(object, model);
  }
  void add_frame(double time, std::span<const FrameObject> objects) override {
    shapes_.set(objects);
    if (pattern_) {
      Output output(pattern_->name(frames_), options_);
      shapes_.write(kind_, output);
      output.commit();
    }
    ++frames_;
    time_ = time;
  }
  void commit() override {
    if (!last_)
      return;
    shapes_.write(kind_, *last_);
    last_->commit();
  }
  std::optional<KeptResult> keep_partial(const std::string& /*why*/) override {
    if (pattern_)
      return series_kept(path_, frames_, time_);
    if (frames_ < 2 || !last_->has_temporary())
      return std::nullopt;
    last_->start_over();
    shapes_.write(kind_, *last_);
    return KeptResult{"the shape", time_, false, "", last_->commit_partial()};
  }

private:
  Kind kind_;
  std::string path_;
  Output::Options options_;
  std::optional<SeriesName> pattern_; ///< of a series, else
  std::optional<Output> last_;
  Shapes shapes_;
  std::uint64_t frames_ = 0;
  double time_ = 0;
};

} // namespace

std::unique_ptr<ResultWriter> open_mesh_result(Kind kind, const std::string& path,
                                               const Output::Options& options) {
  return std::make_unique<ShapeWriter>(kind, path, options);
}

} // namespace gewebe::formats
