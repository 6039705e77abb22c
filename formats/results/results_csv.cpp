#include "formats/results/results_csv.h"

#include "base/error.h"
#include "text/number_text.h"

#include <cmath>
#include <fstream>
#include <map>
#include <optional>
#include <span>
#include <vector>

namespace gewebe::formats {

namespace {

// ---- forces of nodes

class ForceTable final : public ResultWriter {
public:
  ForceTable(const std::string& path, const Output::Options& options) : output_(path, options) {
    output_.write("time,object,node,fx,fy,fz\n");
  }

  bool wants_models() const override { return false; }

  void add_object(const std::string& name, const model::Model& /*model*/) override {
    names_.push_back(name);
  }

  void add_frame(double time, std::span<const FrameObject> objects) override {
    const std::string start = gewebe::text::number_text(time) + ",";
    std::string rows;
    for (std::size_t i = 0; i < objects.size(); ++i)
      for (const contact::NodeVector& f : objects[i].forces)
        rows += start + names_[i] + "," + std::to_string(f.node) + "," +
                gewebe::text::number_text(f.value.x) + "," + gewebe::text::number_text(f.value.y) +
                "," + gewebe::text::number_text(f.value.z) + "\n";
    output_.append_whole(rows);
    ++frames_;
    time_ = time;
  }

  void commit() override { output_.commit(); }

  void outlive_signals() override { output_.outlive_signals(); }

  std::optional<KeptResult> keep_partial(const std::string& /*why*/) override {
    if (frames_ < 2 || !output_.has_temporary())
      return std::nullopt;
    return KeptResult{"forces of " + frames_text(frames_), time_, true, "",
                      output_.commit_partial()};
  }

private:
  Output output_;
  std::uint64_t frames_ = 0;
  double time_ = 0;
  std::vector<std::string> names_;
};

// ---- curves

/// Columns in the order in which they come, and the cells of one row.
class Columns {
public:
  /// An empty cell where there is no number.
  void set(const std::string& owner, const char* quantity, const char* unit, double value) {
    const std::string name = owner + (owner.empty() ? "" : ".") + quantity +
                             (*unit == 0 ? "" : " [") + unit + (*unit == 0 ? "" : "]");
    const auto [at, fresh] = places_.emplace(name, cells_.size());
    if (fresh) {
      header_ += (header_.empty() ? "" : ",") + name;
      cells_.emplace_back();
    }
    if (!std::isnan(value))
      cells_[at->second] = gewebe::text::number_text(value + 0.0); // -0 as 0
  }
  /// Also the length of the vector.
  void set_vector(const std::string& owner, const std::string& quantity, const char* unit,
                  const Vec3& v) {
    set_axes(owner, quantity + "_", unit, v);
    set(owner, quantity.c_str(), unit, norm(v));
  }
  void set_axes(const std::string& owner, const std::string& start, const char* unit,
                const Vec3& v) {
    set(owner, (start + "x").c_str(), unit, v.x);
    set(owner, (start + "y").c_str(), unit, v.y);
    set(owner, (start + "z").c_str(), unit, v.z);
  }
  std::size_t count() const { return cells_.size(); }
  std::string header() const { return header_ + "\n"; }
  /// The row, whose cells are empty from then on.
  std::string take_row() {
    std::string row;
    for (std::string& cell : cells_) {
      row += (&cell == &cells_.front() ? "" : ",") + cell;
      cell.clear();
    }
    return row + "\n";
  }

private:
  std::map<std::string, std::size_t> places_;
  std::string header_;
  std::vector<std::string> cells_;
};

/// Position of an instrument since it touched something.
struct Indentation {
  std::optional<Vec3> start; ///< position in the last frame without a touch

  /// mm; 0 while nothing is touched
  double update(const FrameInstrument& i) {
    if (!start || i.nodes == 0)
      start = i.pose.place;
    return norm(i.pose.place - *start);
  }
};

class CurveTable final : public ResultWriter {
public:
  CurveTable(const std::string& path, const Output::Options& options) : output_(path, options) {
    columns_.set("", "time", "s", 0);
    if (output_.has_temporary())
      output_.append_whole(columns_.header());
  }

  bool wants_models() const override { return false; }
  bool wants_curves() const override { return true; }

  void add_object(const std::string& name, const model::Model& /*model*/) override {
    names_.push_back(name);
  }

  void set_instruments(std::span<const FrameInstrument> instruments) override {
    for (const FrameInstrument& i : instruments) {
      const std::string name(i.name);
      if (!i.present) {
        indentations_[name].start.reset();
        continue;
      }
      columns_.set_axes(name, "", "mm", i.pose.place);
      const contact::Quaternion& q = i.pose.turn;
      columns_.set(name, "turn_w", "", q.w);
      columns_.set_axes(name, "turn_", "", {q.x, q.y, q.z});
      columns_.set_axes(name, "hand_", "mm", i.hand);
      columns_.set(name, "depth", "mm", indentations_[name].update(i));
      columns_.set_vector(name, "force", "uN", i.force);
      columns_.set_vector(name, "torque", "nN m", i.torque);
      columns_.set(name, "touched", "", static_cast<double>(i.nodes));
    }
  }

  void set_attachments(std::span<const FrameAttachment> attachments) override {
    for (const FrameAttachment& a : attachments) {
      const std::string name = std::string(a.name) + "+" + std::string(a.other);
      columns_.set_vector(name, "attach_force", "uN", a.force);
      columns_.set(name, "springs", "", static_cast<double>(a.springs));
    }
  }

  void add_frame(double time, std::span<const FrameObject> objects) override {
    columns_.set("", "time", "s", time);
    for (std::size_t i = 0; i < objects.size(); ++i)
      set_object(names_[i], objects[i]);
    write_row(columns_.take_row());
    ++frames_;
    time_ = time;
  }

  void commit() override {
    if (!output_.has_temporary())
      output_.write(columns_.header() + padded(waiting_));
    output_.commit();
  }

  void outlive_signals() override { output_.outlive_signals(); }

  std::optional<KeptResult> keep_partial(const std::string& /*why*/) override {
    if (frames_ < 2 || !output_.has_temporary())
      return std::nullopt;
    return KeptResult{frames_text(frames_), time_, true, "", output_.commit_partial()};
  }

private:
  void set_object(const std::string& name, const FrameObject& object) {
    Vec3 force;
    for (const contact::NodeVector& f : object.forces)
      force += f.value;
    columns_.set_vector(name, "node_force", "uN", force);
    columns_.set(name, "force_nodes", "", static_cast<double>(object.forces.size()));
    if (object.largest_displacement)
      columns_.set(name, "largest_displacement", "mm", *object.largest_displacement);
    if (object.fields != nullptr) {
      double largest = 0;
      for (const linalg::SymmetricBlock& stress : object.fields->node_stress)
        if (const double size = fem::von_mises(stress); !(size <= largest))
          largest = size;
      columns_.set(name, "largest_von_mises", "Pa", largest);
    }
    if (object.estimate != nullptr && *object.estimate) {
      const fem::DiscretisationError& error = **object.estimate;
      columns_.set(name, "estimate_relative", "", error.relative);
      columns_.set(name, "estimate_force", "uN", error.force);
      columns_.set(name, "estimate_displacement", "mm", error.displacement);
      columns_.set(name, "estimate_stress", "Pa", error.stress);
    }
  }

  void write_row(const std::string& row) {
    if (!output_.has_temporary()) {
      waiting_ += row;
      return;
    }
    if (columns_.count() == written_columns_) {
      output_.append_whole(row);
      return;
    }
    std::ifstream file(output_.temporary(), std::ios::binary);
    std::string before((std::istreambuf_iterator<char>(file)), {});
    if (!file)
      throw Error(output_.name(), "cannot read its first rows again");
    before.erase(0, before.find('\n') + 1);
    output_.start_over();
    output_.append_whole(columns_.header() + padded(before) + row);
    written_columns_ = columns_.count();
  }

  /// Rows of fewer columns with empty cells at their ends.
  std::string padded(const std::string& rows) const {
    std::string all;
    std::size_t cells = 1;
    for (const char c : rows) {
      if (c == '\n') {
        all.append(columns_.count() - cells, ',');
        cells = 0;
      }
      cells += c == ',' || c == '\n' ? 1 : 0;
      all += c;
    }
    return all;
  }

  Output output_;
  Columns columns_;
  std::size_t written_columns_ = 1;
  std::string waiting_;                             ///< rows, where there is no temporary file
  std::map<std::string, Indentation> indentations_; ///< by instrument
  std::uint64_t frames_ = 0;
  double time_ = 0;
  std::vector<std::string> names_;
};

} // namespace

std::unique_ptr<ResultWriter> open_csv_result(const std::string& path,
                                              const Output::Options& options, TableRows rows) {
  if (rows == TableRows::node)
    return std::make_unique<ForceTable>(path, options);
  return std::make_unique<CurveTable>(path, options);
}

} // namespace gewebe::formats
