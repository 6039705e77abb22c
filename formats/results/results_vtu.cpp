#include "formats/results/results_vtu.h"
// Based on: VTK file formats, docs.vtk.org, "XML file formats".

#include "formats/results/grid_internal.h"
#include "formats/results/series_internal.h"
#include "text/number_text.h"

#include <cstdint>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

namespace gewebe::formats {

namespace {

/// Arrays behind the text, each with its size before it.
class Arrays {
public:
  template <class Value>
  void add(std::string& text, const char* name, std::size_t components,
           const std::vector<Value>& values) {
    const char* const type = std::is_same_v<Value, double>         ? "Float64"
                             : std::is_same_v<Value, std::int64_t> ? "Int64"
                             : std::is_same_v<Value, std::int32_t> ? "Int32"
                                                                   : "UInt8";
    text += std::string("<DataArray type=\"") + type + "\" Name=\"" + name +
            "\" NumberOfComponents=\"" + std::to_string(components) +
            "\" format=\"appended\" offset=\"" + std::to_string(bytes_.size()) + "\"/>\n";
    const std::uint64_t size = values.size() * sizeof(Value);
    bytes_.append(reinterpret_cast<const char*>(&size), sizeof size);
    bytes_.append(reinterpret_cast<const char*>(values.data()), size);
  }
  const std::string& bytes() const { return bytes_; }

private:
  std::string bytes_;
};

class VtuWriter final : public ResultWriter {
public:
  VtuWriter(const std::string& path, const Output::Options& options)
      : path_(path), options_(options), series_(series_in(path)) {
    options_.binary = true;
    if (!series_)
      last_.emplace(path, options_);
  }

  void add_object(const std::string& /*name*/, const model::Model& model) override {
    shapes_.add(model);
  }
  void change_object(std::size_t object, const model::Model& model,
                     std::span<const std::uint32_t> /*origin*/) override {
    shapes_.change(object, model);
  }
  void set_instruments(std::span<const FrameInstrument> instruments) override {
    (void)shapes_.set(instruments);
  }
  void add_frame(double time, std::span<const FrameObject> objects) override {
    time_ = time;
    shapes_.set(objects);
    if (series_) {
      Output output(series_->name(frames_), options_);
      write(output);
      output.commit();
    }
    ++frames_;
  }
  void commit() override {
    if (!last_)
      return;
    write(*last_);
    last_->commit();
  }
  std::optional<KeptResult> keep_partial(const std::string& /*why*/) override {
    if (series_)
      return series_kept(path_, frames_, time_);
    if (frames_ < 2 || !last_->has_temporary())
      return std::nullopt;
    last_->start_over();
    write(*last_);
    return KeptResult{"the shape", time_, false, "", last_->commit_partial()};
  }

private:
  void write(Output& output) const {
    const grid::Joined all = grid::join(shapes_.all());
    const bool fields = grid::have_fields(shapes_.all());
    Arrays arrays;
    std::string text =
        "<?xml version=\"1.0\"?>\n<!-- gewebe_results, millimetres -->\n"
        "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" "
        "header_type=\"UInt64\">\n<UnstructuredGrid>\n<FieldData>\n"
        "<DataArray type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\" format=\"ascii\">" +
        gewebe::text::number_text(time_) + "</DataArray>\n</FieldData>\n<Piece NumberOfPoints=\"" +
        std::to_string(all.points.size() / 3) + "\" NumberOfCells=\"" +
        std::to_string(all.types.size()) + "\">\n<Points>\n";
    arrays.add(text, "Points", 3, all.points);
    text += "</Points>\n<Cells>\n";
    arrays.add(text, "connectivity", 1, all.nodes);
    arrays.add(text, "offsets", 1, all.ends);
    arrays.add(text, "types", 1, all.types);
    text += "</Cells>\n<PointData Vectors=\"displacement\">\n";
    arrays.add(text, "displacement", 3, grid::displacements(shapes_.all()));
    if (fields)
      for (const grid::Field& field : grid::node_fields)
        arrays.add(text, field.name, field.components(), grid::values_of(shapes_.all(), field));
    text += "</PointData>\n<CellData Scalars=\"material\">\n";
    arrays.add(text, "material", 1, all.material);
    arrays.add(text, "object", 1, all.object);
    if (fields)
      for (const grid::Field& field : grid::cell_fields)
        arrays.add(text, field.name, field.components(), grid::values_of(shapes_.all(), field));
    text += "</CellData>\n</Piece>\n</UnstructuredGrid>\n<AppendedData encoding=\"raw\">\n_";
    output.write(text);
    output.write(arrays.bytes());
    output.write("\n</AppendedData>\n</VTKFile>\n");
  }

  std::string path_;
  Output::Options options_;
  std::optional<SeriesName> series_; ///< else
  std::optional<Output> last_;
  grid::Shapes shapes_;
  double time_ = 0;
  std::uint64_t frames_ = 0;
};

} // namespace

std::unique_ptr<ResultWriter> open_vtu_result(const std::string& path,
                                              const Output::Options& options) {
  return std::make_unique<VtuWriter>(path, options);
}

} // namespace gewebe::formats
