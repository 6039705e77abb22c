#include "formats/results/results_vtkhdf.h"
// Based on: VTK file formats, docs.vtk.org, "VTKHDF file format": unstructured grids over time. A
// file has one part for each grid there was; frames between cuts share it.

#include "base/error.h"
#include "formats/results/grid_internal.h"
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

namespace gewebe {

namespace {

/// An array that grows, and where each frame begins in it.
class Track {
public:
  Track(hdf5::Group& group, const std::string& name, hdf5::Number type, std::size_t components)
      : name_(name), components_(components),
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
  void begin_frame(std::int64_t row) { begin_.push_back(row); }
  std::int64_t rows() const noexcept { return rows_; }
  void write_begins(hdf5::Group& steps) const { steps.write(name_, begin_); }

private:
  std::string name_;
  std::size_t components_;
  hdf5::Dataset values_;
  std::int64_t rows_ = 0;
  std::vector<std::int64_t> begin_;
};

class VtkHdfWriter final : public ResultWriter {
public:
  VtkHdfWriter(const std::string& path, const Output::Options& options)
      : output_(path, with_sync(options)) {
    in_place([&] {
      file_.emplace(hdf5::File::create(output_.temporary()));
      root_.emplace(file_->root().create_group("VTKHDF"));
      const std::array<std::int64_t, 2> version{2, 0};
      root_->set("Version", std::span<const std::int64_t>(version));
      root_->set("Type", "UnstructuredGrid");
      points_.emplace(*root_, "Points", hdf5::Number::float64, 3);
      nodes_.emplace(*root_, "Connectivity", hdf5::Number::int64, 1);
      ends_.emplace(*root_, "Offsets", hdf5::Number::int64, 1);
      types_.emplace(*root_, "Types", hdf5::Number::uint8, 1);
      of_points_.emplace(root_->create_group("PointData"));
      of_cells_.emplace(root_->create_group("CellData"));
      displacement_.emplace(*of_points_, "displacement", hdf5::Number::float64, 3);
      material_.emplace(*of_cells_, "material", hdf5::Number::int32, 1);
      object_.emplace(*of_cells_, "object", hdf5::Number::int32, 1);
    });
  }

  void add_object(const std::string& /*name*/, const Model& model) override {
    shapes_.add(model);
    changed_ = true;
  }
  void change_object(std::size_t object, const Model& model,
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
      times_.push_back(time);
      part_.push_back(static_cast<std::int64_t>(parts_.size()) - 1);
      displacement_->begin_frame(displacement_->rows());
      displacement_->append(grid::displacements(shapes_.all()));
      material_->begin_frame(parts_.back().first_cell);
      object_->begin_frame(parts_.back().first_cell);
      for (auto& [field, track] : fields_) {
        track.begin_frame(track.rows());
        track.append(grid::values_of(shapes_.all(), field));
      }
    });
  }

  void commit() override {
    in_place([&] {
      const auto of_parts = [&](std::int64_t Part::*what) {
        std::vector<std::int64_t> values;
        for (const Part& part : parts_)
          values.push_back(part.*what);
        return values;
      };
      root_->write("NumberOfPoints", of_parts(&Part::points));
      root_->write("NumberOfCells", of_parts(&Part::cells));
      root_->write("NumberOfConnectivityIds", of_parts(&Part::nodes));
      hdf5::Group steps = root_->create_group("Steps");
      const std::uint64_t frames = times_.size();
      const auto of_frames = [&](const char* name, std::int64_t Part::*what,
                                 const hdf5::Shape& shape) {
        std::vector<std::int64_t> values;
        for (const std::int64_t part : part_)
          values.push_back(parts_[static_cast<std::size_t>(part)].*what);
        steps.write(name, std::span<const std::int64_t>(values), shape);
      };
      steps.set("NSteps", static_cast<std::int64_t>(frames));
      steps.write("Values", times_);
      steps.write("PartOffsets", part_);
      steps.write("NumberOfParts", std::vector<std::int64_t>(frames, 1));
      of_frames("PointOffsets", &Part::first_point, {frames});
      of_frames("CellOffsets", &Part::first_cell, {frames, 1});
      of_frames("ConnectivityIdOffsets", &Part::first_node, {frames, 1});
      hdf5::Group of_points = steps.create_group("PointDataOffsets"),
                  of_cells = steps.create_group("CellDataOffsets");
      displacement_->write_begins(of_points);
      material_->write_begins(of_cells);
      object_->write_begins(of_cells);
      for (const auto& [field, track] : fields_)
        track.write_begins(field.of_cells ? of_cells : of_points);
      file_->close();
    });
    output_.commit();
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

  /// Errors name the file that is asked for, not the temporary one.
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
                      static_cast<std::int64_t>(all.nodes.size()), points_->rows(), types_->rows(),
                      nodes_->rows()});
    points_->append(all.points);
    nodes_->append(all.nodes);
    std::vector<std::int64_t> ends{0}; // of each part anew
    ends.insert(ends.end(), all.ends.begin(), all.ends.end());
    ends_->append(ends);
    types_->append(all.types);
    material_->append(all.material);
    object_->append(all.object);
  }

  /// Frames that have none yet share rows without a number.
  void begin_fields() {
    std::int64_t points = 0, cells = 0;
    for (const std::int64_t part : part_) {
      points = std::max(points, parts_[static_cast<std::size_t>(part)].points);
      cells = std::max(cells, parts_[static_cast<std::size_t>(part)].cells);
    }
    for (const auto& some : {grid::node_fields, grid::cell_fields})
      for (const grid::Field& field : some) {
        Track track(field.of_cells ? *of_cells_ : *of_points_, field.name, hdf5::Number::float64,
                    field.components());
        const auto rows = static_cast<std::size_t>(field.of_cells ? cells : points);
        track.append(std::vector<double>(rows * field.components(),
                                         std::numeric_limits<double>::quiet_NaN()));
        for (std::size_t frame = 0; frame < times_.size(); ++frame)
          track.begin_frame(0);
        fields_.emplace_back(field, std::move(track));
      }
  }

  Output output_;
  std::optional<hdf5::File> file_;
  std::optional<hdf5::Group> root_, of_points_, of_cells_;
  std::optional<Track> points_, nodes_, ends_, types_, displacement_, material_, object_;
  std::vector<std::pair<grid::Field, Track>> fields_;
  grid::Shapes shapes_;
  bool changed_ = false; ///< since the last part
  std::vector<Part> parts_;
  std::vector<double> times_;
  std::vector<std::int64_t> part_; ///< of each frame
};

} // namespace

std::unique_ptr<ResultWriter> open_vtkhdf_result(const std::string& path,
                                                 const Output::Options& options) {
  return std::make_unique<VtkHdfWriter>(path, options);
}

} // namespace gewebe
