#include "formats/results/results_vtkhdf.h"
// Based on: VTK file formats, docs.vtk.org, "VTKHDF file format": unstructured grids over time. A
// file has one part for each grid there was; frames between cuts share it.

#include "base/error.h"
#include "formats/results/grid_internal.h"
#include "formats/results/partial_result.h"
#include "formats/store/hdf5_internal.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace gewebe::formats {

namespace {

/// A list of numbers that grows.
class List {
public:
  List(hdf5::Group& group, const std::string& name, const hdf5::Shape& row = {})
      : values_(group.create_growing(name, hdf5::Number::int64, row, 512)) {}
  void append(std::int64_t value) { values_.append(std::span<const std::int64_t>(&value, 1)); }

private:
  hdf5::Dataset values_;
};

/// An array that grows, and where each frame begins in it.
class Track {
public:
  Track(hdf5::Group& group, hdf5::Group& steps, const std::string& name, hdf5::Number type,
        std::size_t components)
      : Track(group, name, type, components) {
    begin_.emplace(steps, name);
  }
  /// Of the grids, which begin where their part does.
  Track(hdf5::Group& group, const std::string& name, hdf5::Number type, std::size_t components)
      : components_(components),
        values_(group.create_growing(name, type,
                                     components > 1 ? hdf5::Shape{components} : hdf5::Shape{},
                                     65536 / (components * hdf5::size_of(type)))) {}

  template <class T>
  void append(const std::vector<T>& values) {
    if (values.empty())
      return;
    values_.append(std::span<const T>(values));
    rows_ += static_cast<std::int64_t>(values.size() / components_);
  }
  void begin_frame(std::int64_t row) { begin_->append(row); }
  std::int64_t rows() const noexcept { return rows_; }

private:
  std::size_t components_;
  hdf5::Dataset values_;
  std::int64_t rows_ = 0;
  std::optional<List> begin_;
};

struct VtkHdfGroups {
  std::optional<hdf5::Group> root, of_points, of_cells, steps, point_steps, cell_steps;
};

/// Values of all parts, one part behind the other, and how many each has.
struct VtkHdfTracks {
  std::optional<Track> points, nodes, ends, types, displacement, material, object;
  std::optional<List> point_count, cell_count, node_count;
};

/// By frame.
struct VtkHdfFrames {
  std::optional<hdf5::Dataset> times;
  std::optional<List> part, part_count, first_point, first_cell, first_node;
};

class VtkHdfWriter final : public ResultWriter {
public:
  VtkHdfWriter(const std::string& path, const Output::Options& options)
      : output_(path, with_sync(options)) {
    in_place([&] {
      file_.emplace(hdf5::File::create_with_checkpoints(output_.temporary()));
      groups_.root.emplace(file_->root().create_group("VTKHDF"));
      const std::array<std::int64_t, 2> version{2, 0};
      groups_.root->set("Version", std::span<const std::int64_t>(version));
      groups_.root->set("Type", "UnstructuredGrid");
      tracks_.points.emplace(*groups_.root, "Points", hdf5::Number::float64, 3);
      tracks_.nodes.emplace(*groups_.root, "Connectivity", hdf5::Number::int64, 1);
      tracks_.ends.emplace(*groups_.root, "Offsets", hdf5::Number::int64, 1);
      tracks_.types.emplace(*groups_.root, "Types", hdf5::Number::uint8, 1);
      groups_.of_points.emplace(groups_.root->create_group("PointData"));
      groups_.of_cells.emplace(groups_.root->create_group("CellData"));
      groups_.steps.emplace(groups_.root->create_group("Steps"));
      groups_.point_steps.emplace(groups_.steps->create_group("PointDataOffsets"));
      groups_.cell_steps.emplace(groups_.steps->create_group("CellDataOffsets"));
      tracks_.displacement.emplace(*groups_.of_points, *groups_.point_steps, "displacement",
                                   hdf5::Number::float64, 3);
      tracks_.material.emplace(*groups_.of_cells, *groups_.cell_steps, "material",
                               hdf5::Number::int32, 1);
      tracks_.object.emplace(*groups_.of_cells, *groups_.cell_steps, "object", hdf5::Number::int32,
                             1);
      for (std::optional<List>* const list :
           {&tracks_.point_count, &tracks_.cell_count, &tracks_.node_count})
        list->emplace(*groups_.root, list == &tracks_.point_count  ? "NumberOfPoints"
                                     : list == &tracks_.cell_count ? "NumberOfCells"
                                                                   : "NumberOfConnectivityIds");
      groups_.steps->set("NSteps", std::int64_t{0});
      in_frames_.times.emplace(
          groups_.steps->create_growing("Values", hdf5::Number::float64, {}, 512));
      in_frames_.part.emplace(*groups_.steps, "PartOffsets");
      in_frames_.part_count.emplace(*groups_.steps, "NumberOfParts");
      in_frames_.first_point.emplace(*groups_.steps, "PointOffsets");
      in_frames_.first_cell.emplace(*groups_.steps, "CellOffsets", hdf5::Shape{1});
      in_frames_.first_node.emplace(*groups_.steps, "ConnectivityIdOffsets", hdf5::Shape{1});
    });
  }

  void add_object(const std::string& /*name*/, const model::Model& model) override {
    shapes_.add(model);
    changed_ = true;
  }
  void change_object(std::size_t object, const model::Model& model,
                     std::span<const std::uint32_t> /*origin*/) override {
    shapes_.change(object, model);
    changed_ = true;
  }
  void set_instruments(std::span<const FrameInstrument> instruments) override {
    if (shapes_.set(instruments))
      changed_ = true;
  }

  void add_frame(double time, std::span<const FrameObject> objects) override {
    shapes_.set(objects);
    in_place([&] {
      if (std::exchange(changed_, false) || parts_.empty())
        begin_part();
      if (fields_.empty() && grid::have_fields(shapes_.all()))
        begin_fields();
      const Part& part = parts_.back();
      in_frames_.times->append(std::span<const double>(&time, 1));
      in_frames_.part->append(static_cast<std::int64_t>(parts_.size()) - 1);
      in_frames_.part_count->append(1);
      in_frames_.first_point->append(part.first_point);
      in_frames_.first_cell->append(part.first_cell);
      in_frames_.first_node->append(part.first_node);
      tracks_.displacement->begin_frame(tracks_.displacement->rows());
      tracks_.displacement->append(grid::displacements(shapes_.all()));
      tracks_.material->begin_frame(part.first_cell);
      tracks_.object->begin_frame(part.first_cell);
      for (auto& [field, track] : fields_) {
        track.begin_frame(track.rows());
        track.append(grid::values_of(shapes_.all(), field));
      }
      ++frames_;
      last_part_ = parts_.size() - 1;
      groups_.steps->replace("NSteps", static_cast<std::int64_t>(frames_));
      file_->checkpoint();
    });
  }

  void commit() override {
    in_place([&] { file_->close(); });
    output_.commit();
  }

  void outlive_signals() override { output_.outlive_signals(); }

  std::optional<KeptResult> keep_partial(const std::string& why) override {
    if (frames_ < 2)
      return std::nullopt;
    file_->abandon();
    const PartialFrames there = mark_partial(output_.temporary(), why);
    return KeptResult{frames_text(there.frames), there.time, true, "", output_.commit_partial()};
  }

private:
  /// A grid and where it begins.
  struct Part {
    std::int64_t points = 0, cells = 0, nodes = 0;
    std::int64_t first_point = 0, first_cell = 0, first_node = 0;
  };

  static Output::Options with_sync(Output::Options options) {
    options.sync = true;
    options.binary = true;
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

  void begin_part() {
    const grid::Joined all = grid::join(shapes_.all());
    parts_.push_back({static_cast<std::int64_t>(all.points.size() / 3),
                      static_cast<std::int64_t>(all.types.size()),
                      static_cast<std::int64_t>(all.nodes.size()), tracks_.points->rows(),
                      tracks_.types->rows(), tracks_.nodes->rows()});
    tracks_.point_count->append(parts_.back().points);
    tracks_.cell_count->append(parts_.back().cells);
    tracks_.node_count->append(parts_.back().nodes);
    tracks_.points->append(all.points);
    tracks_.nodes->append(all.nodes);
    std::vector<std::int64_t> ends{0}; // restarts in each part
    ends.insert(ends.end(), all.ends.begin(), all.ends.end());
    tracks_.ends->append(ends);
    tracks_.types->append(all.types);
    tracks_.material->append(all.material);
    tracks_.object->append(all.object);
  }

  /// Frames that have none yet share rows without a number.
  void begin_fields() {
    std::int64_t points = 0, cells = 0;
    for (std::size_t part = 0; frames_ > 0 && part <= last_part_; ++part) {
      points = std::max(points, parts_[part].points);
      cells = std::max(cells, parts_[part].cells);
    }
    for (const auto& some : {grid::node_fields, grid::cell_fields})
      for (const grid::Field& field : some) {
        Track track(field.of_cells ? *groups_.of_cells : *groups_.of_points,
                    field.of_cells ? *groups_.cell_steps : *groups_.point_steps, field.name,
                    hdf5::Number::float64, field.components());
        const auto rows = static_cast<std::size_t>(field.of_cells ? cells : points);
        track.append(std::vector<double>(rows * field.components(),
                                         std::numeric_limits<double>::quiet_NaN()));
        for (std::uint64_t frame = 0; frame < frames_; ++frame)
          track.begin_frame(0);
        fields_.emplace_back(field, std::move(track));
      }
  }

  Output output_;
  std::optional<hdf5::File> file_;
  VtkHdfGroups groups_;
  VtkHdfTracks tracks_;
  VtkHdfFrames in_frames_;
  std::vector<std::pair<grid::Field, Track>> fields_;
  grid::Shapes shapes_;
  bool changed_ = false; ///< since the last part
  std::vector<Part> parts_;
  std::uint64_t frames_ = 0;
  std::size_t last_part_ = 0; ///< of the last frame
};

} // namespace

std::unique_ptr<ResultWriter> open_vtkhdf_result(const std::string& path,
                                                 const Output::Options& options) {
  return std::make_unique<VtkHdfWriter>(path, options);
}

} // namespace gewebe::formats
