#include "formats/results/results_writer.h"

#include "base/error.h"
#include "embedding/skin.h"
#include "formats/results/instrument_sets_internal.h"
#include "formats/results/partial_result.h"
#include "formats/results/results_csv.h"
#include "formats/results/results_mesh.h"
#include "formats/results/results_vtkhdf.h"
#include "formats/results/results_vtu.h"
#include "formats/results/xdmf_internal.h"
#include "formats/store/hdf5_internal.h"
#include "formats/stream/file_names.h"
#include "text/number_text.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

namespace gewebe::formats {

namespace {

// ---- HDF5 and XDMF

std::string base_name(const std::string& path) {
  return path.substr(path.find_last_of('/') + 1);
}

std::vector<float> in_single(std::span<const double> values, const char* what, const char* unit) {
  std::vector<float> result(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    result[i] = static_cast<float>(values[i]);
    if (!std::isfinite(result[i]))
      throw Error(std::string(what) + " of " + gewebe::text::number_text(values[i]) + unit +
                  " does not fit single precision, expected a smaller one");
  }
  return result;
}

/// A row under the name by which the XDMF file knows it.
void create_frame_view(hdf5::Group& views, const hdf5::Dataset& set, std::uint64_t row) {
  views.create_row_view(frame_view_name(set.name(), row), set, row);
}

/// Those of a solid, as they grow.
struct FieldSets {
  hdf5::Dataset stress, strain, von_mises, element_stress, element_strain, element_von_mises;
  std::uint64_t first = 0; ///< frame

  FieldSets(hdf5::Group group, std::uint64_t nodes, std::uint64_t elements, std::uint64_t from)
      : stress(tensors(group, "stress", nodes)), strain(tensors(group, "strain", nodes)),
        von_mises(numbers(group, "von_mises", nodes)),
        element_stress(tensors(group, "element_stress", elements)),
        element_strain(tensors(group, "element_strain", elements)),
        element_von_mises(numbers(group, "element_von_mises", elements)), first(from) {
    group.set("first_frame", from);
  }

  /// Those of one frame under names of their own.
  void show_row(hdf5::Group& views, std::uint64_t row) const {
    for (const hdf5::Dataset* const set :
         {&stress, &strain, &von_mises, &element_stress, &element_strain, &element_von_mises})
      create_frame_view(views, *set, row);
  }

  void append(const fem::SolidFields& fields) {
    add(stress, fields.node_stress, "a stress", " Pa");
    add(strain, fields.node_strain, "a strain", "");
    add_von_mises(von_mises, fields.node_stress);
    add(element_stress, fields.element_stress, "a stress", " Pa");
    add(element_strain, fields.element_strain, "a strain", "");
    add_von_mises(element_von_mises, fields.element_stress);
  }

private:
  static hdf5::Dataset tensors(hdf5::Group& group, const char* name, std::uint64_t count) {
    return group.create_growing(name, hdf5::Number::float32, {count, 6}, chunk(6 * count));
  }
  static hdf5::Dataset numbers(hdf5::Group& group, const char* name, std::uint64_t count) {
    return group.create_growing(name, hdf5::Number::float32, {count}, chunk(count));
  }
  static std::uint64_t chunk(std::uint64_t row) {
    return std::max<std::uint64_t>(1, 65536 / (4 * row));
  }
  static void add(hdf5::Dataset& to, const std::vector<linalg::SymmetricBlock>& tensors,
                  const char* what, const char* unit) {
    std::vector<double> values;
    values.reserve(6 * tensors.size());
    for (const linalg::SymmetricBlock& tensor : tensors)
      values.insert(values.end(), tensor.begin(), tensor.end());
    to.append(std::span<const float>(in_single(values, what, unit)));
  }
  static void add_von_mises(hdf5::Dataset& to,
                            const std::vector<linalg::SymmetricBlock>& stresses) {
    std::vector<double> values;
    values.reserve(stresses.size());
    for (const linalg::SymmetricBlock& stress : stresses)
      values.push_back(gewebe::fem::von_mises(stress));
    to.append(std::span<const float>(in_single(values, "a stress", " Pa")));
  }
};

/// Estimated errors of an object over time.
struct EstimateSets {
  hdf5::Dataset relative, force, displacement, stress;

  EstimateSets(hdf5::Group group, std::uint64_t from)
      : relative(numbers(group, "relative")), force(numbers(group, "force")),
        displacement(numbers(group, "displacement")), stress(numbers(group, "stress")) {
    group.set("first_frame", from);
  }

  void append(const std::optional<fem::DiscretisationError>& error) {
    constexpr double none = std::numeric_limits<double>::quiet_NaN();
    add(relative, error ? error->relative : none);
    add(force, error ? error->force : none);
    add(displacement, error ? error->displacement : none);
    add(stress, error ? error->stress : none);
  }

private:
  static hdf5::Dataset numbers(hdf5::Group& group, const char* name) {
    return group.create_growing(name, hdf5::Number::float64, {}, 256);
  }
  static void add(hdf5::Dataset& to, double value) {
    to.append(std::span<const double>(&value, 1));
  }
};

class Hdf5Result final : public ResultWriter {
public:
  Hdf5Result(const std::string& path, const Output::Options& options)
      : output_(path, with_sync(options)) {
    (void)output_.temporary(); // refuses what is no file, before anything is made beside it
    xdmf_.emplace(xdmf_path(path), text(options));
    in_place([&] {
      file_.emplace(hdf5::File::create_with_checkpoints(output_.temporary()));
      hdf5::Group& root = file_->root();
      root.set("format", "gewebe_results");
      root.set("version", std::uint32_t{1});
      root.set("units", "mm g s");
      time_.emplace(root.create_growing("time", hdf5::Number::float64, {}, 256));
      groups_.emplace(root.create_group("objects"));
    });
  }

  void add_object(const std::string& name, const model::Model& model) override {
    in_place([&] {
      Object& object = begin(name, model);
      const std::vector<float> rest(3 * model.nodes.size());
      for (std::uint64_t f = 0; f < frames_; ++f)
        object.displacement.append(std::span<const float>(rest));
    });
  }

  void outlive_signals() override {
    output_.outlive_signals();
    xdmf_->outlive_signals();
  }

  void add_part(const std::string& name, const model::Model& model) override {
    in_place([&] { begin(name, model).group.set("first_frame", frames_); });
  }

  void change_object(std::size_t index, const model::Model& model,
                     std::span<const std::uint32_t> origin) override {
    in_place([&] {
      Object& object = objects_.at(index);
      if (!object.cuts)
        object.cuts.emplace(object.group.create_group("cuts"));
      const std::string number = std::to_string(object.shapes);
      hdf5::Group cut = object.cuts->create_group(number);
      cut.set("first_frame", frames_);
      std::vector<std::uint32_t> from(origin.begin(), origin.end());
      if (from.empty()) {
        from.resize(model.nodes.size());
        std::iota(from.begin(), from.end(), 0U);
      }
      cut.write("origin", from);
      object.displacement = add_shape(cut, model);
      object.views.reset();
      if (stands_alone())
        object.views.emplace(cut.create_group("frames"));
      ++object.shapes;
      object.fields.reset();
      object.shape_group = std::move(cut);
    });
  }

  void set_instruments(std::span<const FrameInstrument> instruments) override {
    in_place([&] { instruments_.add_frame(file_->root(), frames_, instruments); });
    instrumented_ = instrumented_ || !instruments.empty();
    for (const FrameInstrument& instrument : instruments)
      xdmf_bytes_ += xdmf_bytes(output_.name(), std::string(instrument.name), false);
  }

  void add_frame(double time, std::span<const FrameObject> objects) override {
    in_place([&] {
      time_->append(std::span<const double>(&time, 1));
      for (std::size_t i = 0; i < objects.size(); ++i) {
        Object& to = objects_.at(i);
        const std::vector<float> u = in_single(objects[i].displacement, "a displacement", " mm");
        to.displacement.append(std::span<const float>(u));
        if (const fem::SolidFields* const fields = objects[i].fields) {
          if (!to.fields) {
            hdf5::Group& group = to.shape_group ? *to.shape_group : to.group;
            to.fields.emplace(group.create_group("fields"), fields->node_stress.size(),
                              fields->element_stress.size(), frames_);
          }
          to.fields->append(*fields);
        }
        if (stands_alone()) {
          create_frame_view(*to.views, to.displacement, to.displacement.rows() - 1);
          if (objects[i].fields)
            to.fields->show_row(*to.views, to.fields->stress.rows() - 1);
        }
        xdmf_bytes_ += xdmf_bytes(output_.name(), to.name, objects[i].fields != nullptr);
        if (objects[i].estimate) {
          if (!to.estimates)
            to.estimates.emplace(to.group.create_group("estimates"), frames_);
          to.estimates->append(*objects[i].estimate);
        }
        const std::span<const contact::NodeVector> forces = objects[i].forces;
        if (forces.empty())
          continue;
        std::vector<std::uint64_t> frame(forces.size(), frames_);
        std::vector<std::uint32_t> node;
        std::vector<double> force;
        for (const contact::NodeVector& f : forces) {
          node.push_back(f.node);
          force.insert(force.end(), {f.value.x, f.value.y, f.value.z});
        }
        to.frame.append(std::span<const std::uint64_t>(frame));
        to.node.append(std::span<const std::uint32_t>(node));
        to.force.append(std::span<const double>(force));
      }
    });
    reserve_companion();
    in_place([&] { file_->checkpoint(); });
    ++frames_;
  }

  void commit() override {
    in_place([&] { file_->close(); });
    write_companion(output_.name());
    xdmf_->prepare(); // so that nothing is renamed unless all is written
    output_.commit();
    xdmf_->commit();
  }

  std::optional<KeptResult> keep_partial(const std::string& why) override {
    if (frames_ < 2)
      return std::nullopt;
    forget();
    const PartialFrames there = mark_partial(output_.temporary(), why);
    KeptResult kept{frames_text(there.frames), there.time, true, "", ""};
    try {
      xdmf_->start_over();
      write_companion(partial_name(output_.name()));
      (void)xdmf_->commit_partial();
    } catch (const Error& error) {
      kept.left_out = error.place() + ": " + error.what();
    }
    kept.file = output_.commit_partial();
    return kept;
  }

private:
  struct Object {
    std::string name;
    hdf5::Group group;
    hdf5::Dataset displacement, frame, node, force;
    std::uint64_t shapes = 1;                     ///< that it had, one after the other
    std::optional<hdf5::Group> cuts, shape_group; ///< and, of one that was cut, of its last shape
    std::optional<FieldSets> fields;
    std::optional<EstimateSets> estimates;
    std::optional<hdf5::Group> views; ///< of the last shape's frames, while the object is alone
  };

  /// Whether a frame is one mesh, as readers want it that know of no other.
  bool stands_alone() const { return objects_.size() == 1 && !instrumented_; }

  Object& begin(const std::string& name, const model::Model& model) {
    hdf5::Group group = groups_->create_group(name);
    group.set("order", static_cast<std::uint32_t>(objects_.size()));
    group.set("model", model.name);
    std::vector<std::string> materials;
    for (const model::Material& material : model.materials)
      materials.push_back(material.name);
    group.write_texts("materials", materials);
    hdf5::Dataset displacement = add_shape(group, model);
    hdf5::Group forces = group.create_group("forces");
    hdf5::Dataset frame = forces.create_growing("frame", hdf5::Number::uint64, {}, 512);
    hdf5::Dataset node = forces.create_growing("node", hdf5::Number::uint32, {}, 512);
    hdf5::Dataset force = forces.create_growing("force", hdf5::Number::float64, {3}, 512);
    objects_.push_back({name, std::move(group), std::move(displacement), std::move(frame),
                        std::move(node), std::move(force), 1, std::nullopt, std::nullopt,
                        std::nullopt, std::nullopt, std::nullopt});
    Object& object = objects_.back();
    if (stands_alone())
      object.views.emplace(object.group.create_group("frames"));
    return object;
  }

  /// What stands in a group of a model at rest; the displacements to come.
  static hdf5::Dataset add_shape(hdf5::Group& group, const model::Model& model) {
    const std::uint64_t n = model.nodes.size();
    group.set("surface_nodes", static_cast<std::uint64_t>(model::surface_count(model)));
    std::vector<double> points;
    points.reserve(3 * n);
    for (const model::Node& node : model.nodes)
      points.insert(points.end(), {node.position.x, node.position.y, node.position.z});
    group.write("points", std::span<const double>(points), {n, 3});
    add_triangles(group, model::surface_mesh(model));
    if (!model.tetrahedra.empty()) {
      const std::uint64_t nodes = model.middles.empty() ? 4 : 10;
      std::vector<std::uint32_t> elements;
      elements.reserve(nodes * model.tetrahedra.size());
      for (std::size_t t = 0; t < model.tetrahedra.size(); ++t) {
        elements.insert(elements.end(), model.tetrahedra[t].begin(), model.tetrahedra[t].end());
        if (nodes == 10)
          elements.insert(elements.end(), model.middles[t].begin(), model.middles[t].end());
      }
      group.write("tetrahedra", std::span<const std::uint32_t>(elements),
                  {model.tetrahedra.size(), nodes});
      group.write("tetrahedron_material", model.tetrahedron_material);
    }
    if (!model.skin.points.empty())
      add_skin(group, model);
    const std::uint64_t rows = std::max<std::uint64_t>(1, 65536 / (12 * n));
    return group.create_growing("displacement", hdf5::Number::float32, {n, 3}, rows);
  }

  /// What a reader needs to show the skin without knowing elements.
  static void add_skin(hdf5::Group& shape, const model::Model& model) {
    hdf5::Group group = shape.create_group("skin");
    const embedding::SkinWeights follows = embedding::skin_weights(model);
    const TriangleMesh mesh = model::shown_mesh(model);
    const std::uint64_t count = mesh.points.size();
    std::vector<double> points;
    points.reserve(3 * count);
    for (const Vec3& point : mesh.points)
      points.insert(points.end(), {point.x, point.y, point.z});
    group.write("points", std::span<const double>(points), {count, 3});
    group.write("nodes", std::span<const std::uint32_t>(follows.node), {count, follows.nodes});
    group.write("weights", std::span<const double>(follows.weight), {count, follows.nodes});
    add_triangles(group, mesh);
  }

  /// Triangles, with texture coordinates and materials where they have some.
  static void add_triangles(hdf5::Group& group, const TriangleMesh& mesh) {
    std::vector<std::uint32_t> corners;
    corners.reserve(3 * mesh.triangles.size());
    for (const Triangle& t : mesh.triangles)
      corners.insert(corners.end(), t.begin(), t.end());
    group.write("triangles", std::span<const std::uint32_t>(corners), {mesh.triangles.size(), 3});
    if (!mesh.texcoords.empty()) {
      std::vector<float> st;
      st.reserve(6 * mesh.texcoords.size());
      for (const auto& t : mesh.texcoords)
        st.insert(st.end(), t.begin(), t.end());
      group.write("texcoords", std::span<const float>(st), {mesh.texcoords.size(), 3, 2});
    }
    if (!mesh.material.empty())
      group.write("material", mesh.material);
  }

  static Output::Options with_sync(Output::Options options) {
    options.sync = true;
    return options;
  }
  static Output::Options text(Output::Options options) {
    options.sync = true;
    options.binary = false;
    options.beside = true;
    return options;
  }

  /// Errors name the final file, not the temporary one.
  template <class Work>
  void in_place(Work&& work) {
    try {
      work();
    } catch (const Error& error) {
      throw Error(output_.name(), error.what());
    }
  }

  /// \param result the name that the HDF5 file is going to have
  void write_companion(const std::string& result) {
    in_place([&] {
      const hdf5::File file = hdf5::File::open_own(output_.temporary());
      write_xdmf(file, base_name(result), [&](std::string_view text) { xdmf_->write(text); });
    });
  }

  /// So that this frame can be shown, even on a full disk.
  void reserve_companion() {
    constexpr std::uint64_t step = 65536;
    xdmf_bytes_ += 400;
    if (xdmf_bytes_ <= xdmf_reserved_)
      return;
    xdmf_->reserve(xdmf_bytes_);
    xdmf_reserved_ = xdmf_bytes_;
    try {
      xdmf_->reserve(xdmf_bytes_ + step);
      xdmf_reserved_ += step;
    } catch (const Error&) {
      return; // enough for this frame
    }
  }

  /// The file as its last frame left it, and nothing in memory.
  void forget() {
    objects_.clear();
    instruments_ = InstrumentSets();
    groups_.reset();
    time_.reset();
    if (file_)
      file_->abandon();
    file_.reset();
  }

  Output output_;
  std::optional<Output> xdmf_;
  std::optional<hdf5::File> file_;
  std::optional<hdf5::Dataset> time_;
  std::optional<hdf5::Group> groups_;
  std::vector<Object> objects_;
  InstrumentSets instruments_;
  bool instrumented_ = false; ///< some frame had an instrument
  std::uint64_t frames_ = 0;
  std::uint64_t xdmf_bytes_ = 0, xdmf_reserved_ = 0; ///< of the text so far, at most
};

} // namespace

const std::vector<Kind>& result_kinds() {
  static const std::vector<Kind> kinds{Kind::hdf5, Kind::ply,    Kind::obj,
                                       Kind::vtu,  Kind::vtkhdf, Kind::csv};
  return kinds;
}

std::unique_ptr<ResultWriter> open_result(Kind kind, const std::string& path,
                                          const Output::Options& options, TableRows rows) {
  switch (kind) {
  case Kind::hdf5:
    return std::make_unique<Hdf5Result>(path, options);
  case Kind::vtu:
    return open_vtu_result(path, options);
  case Kind::vtkhdf:
    return open_vtkhdf_result(path, options);
  case Kind::csv:
    return open_csv_result(path, options, rows);
  default:
    return open_mesh_result(kind, path, options);
  }
}

} // namespace gewebe::formats
