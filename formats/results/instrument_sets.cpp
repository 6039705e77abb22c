#include "formats/results/instrument_sets_internal.h"

#include "base/error.h"
#include "contact/instrument_surface.h"

#include <array>
#include <cmath>
#include <utility>

namespace gewebe::formats {

namespace {

constexpr std::size_t around = 32;      // corners of a ring
constexpr std::uint64_t rows_kept = 64; // together

hdf5::Dataset grow(hdf5::Group& group, const char* name, hdf5::Number type,
                   const hdf5::Shape& row) {
  return group.create_growing(name, type, row, rows_kept);
}

void put(hdf5::Dataset& to, const std::vector<double>& values) {
  to.append(std::span<const double>(values));
}

void put(hdf5::Dataset& to, const Vec3& v) {
  put(to, std::vector<double>{v.x + 0.0, v.y + 0.0, v.z + 0.0}); // -0 as 0
}

/// A rotation and a translation, row by row.
std::vector<double> matrix_of(const contact::Pose& pose) {
  const std::array<Vec3, 3> columns{contact::rotated(pose.turn, {1, 0, 0}),
                                    contact::rotated(pose.turn, {0, 1, 0}),
                                    contact::rotated(pose.turn, {0, 0, 1})};
  std::vector<double> matrix;
  for (int a = 0; a < 3; ++a) {
    for (const Vec3& column : columns)
      matrix.push_back(column[a] + 0.0);
    matrix.push_back(pose.place[a] + 0.0);
  }
  return matrix;
}

} // namespace

InstrumentSets::Series InstrumentSets::begin(const std::string& name, std::uint64_t frame) {
  using hdf5::Number;
  hdf5::Group group = group_->create_group(name);
  group.set("order", static_cast<std::uint32_t>(series_.size()));
  group.set("first_frame", frame);
  hdf5::Group surfaces = group.create_group("surfaces");
  hdf5::Dataset kind = grow(group, "kind", Number::uint8, {}),
                radius = grow(group, "radius", Number::float64, {}),
                friction = grow(group, "friction", Number::float64, {}),
                ends = grow(group, "ends", Number::float64, {2, 3}),
                pose = grow(group, "pose", Number::float64, {3, 4}),
                hand = grow(group, "hand", Number::float64, {3}),
                force = grow(group, "force", Number::float64, {3}),
                torque = grow(group, "torque", Number::float64, {3}),
                touched = grow(group, "touched", Number::uint32, {});
  return {name,
          frame,
          std::move(group),
          std::move(surfaces),
          std::move(kind),
          std::move(radius),
          std::move(friction),
          std::move(ends),
          std::move(pose),
          std::move(hand),
          std::move(force),
          std::move(torque),
          std::move(touched),
          {}};
}

void InstrumentSets::append(Series& to, const FrameInstrument& of) {
  const auto kind =
      static_cast<std::uint8_t>(of.present ? static_cast<int>(contact::kind_of(of.shape)) : 0);
  to.kind.append(std::span<const std::uint8_t>(&kind, 1));
  const auto touched = static_cast<std::uint32_t>(of.present ? of.nodes : 0);
  to.touched.append(std::span<const std::uint32_t>(&touched, 1));
  if (!of.present) { // rows of zeros
    for (hdf5::Dataset* const set :
         {&to.radius, &to.friction, &to.ends, &to.pose, &to.hand, &to.force, &to.torque})
      put(*set, std::vector<double>(set->row_size()));
    return;
  }
  put(to.radius, std::vector<double>{of.shape.radius});
  put(to.friction, std::vector<double>{of.shape.friction});
  const Vec3 &a = of.pose.place, b = of.pose(of.shape.axis);
  put(to.ends,
      std::vector<double>{a.x + 0.0, a.y + 0.0, a.z + 0.0, b.x + 0.0, b.y + 0.0, b.z + 0.0});
  put(to.pose, matrix_of(of.pose));
  put(to.hand, of.hand);
  put(to.force, of.force);
  put(to.torque, of.torque);
}

void InstrumentSets::show(Series& to, const FrameInstrument& of, std::uint64_t frame) {
  const double radius = contact::shown_radius(of.shape);
  if (!of.present || !(radius > 0))
    return;
  if (to.surfaces.empty() || to.surfaces.back().end != frame ||
      !contact::same_surface(to.surfaces.back().shape, of.shape)) {
    hdf5::Group group = to.surface_group.create_group(std::to_string(to.surfaces.size() + 1));
    group.set("first_frame", frame);
    contact::InstrumentSurface made = contact::shown_surface(of.shape, around);
    std::vector<std::uint32_t> corners;
    corners.reserve(3 * made.triangles.size());
    for (const Triangle& t : made.triangles)
      corners.insert(corners.end(), t.begin(), t.end());
    group.write("triangles", std::span<const std::uint32_t>(corners), {made.triangles.size(), 3});
    const std::uint64_t points = made.points.size();
    if (of.shape.core) { // which a reader cannot rebuild
      std::vector<float> normals;
      for (const Vec3& n : made.normals)
        for (int a = 0; a < 3; ++a)
          normals.push_back(static_cast<float>(n[a] + 0.0));
      group.write("normals", std::span<const float>(normals), {points, 3});
    }
    hdf5::Dataset places = group.create_growing("points", hdf5::Number::float32, {points, 3},
                                                65536 / (12 * points) + 1);
    to.surfaces.push_back(
        {of.shape, frame, frame, points, std::move(places), std::move(made.points)});
  }
  Surface& surface = to.surfaces.back();
  std::vector<float> places;
  places.reserve(3 * surface.points);
  for (const Vec3& own : surface.own) {
    const Vec3 p = of.pose(own);
    for (int a = 0; a < 3; ++a) {
      places.push_back(static_cast<float>(p[a]));
      if (!std::isfinite(places.back()))
        throw Error("the instrument " + std::string(of.name) +
                    " leaves single precision, expected places that don't");
    }
  }
  surface.places.append(std::span<const float>(places));
  surface.end = frame + 1;
}

void InstrumentSets::add_frame(hdf5::Group& root, std::uint64_t frame,
                               std::span<const FrameInstrument> instruments) {
  if (!instruments.empty() && !group_)
    group_.emplace(root.create_group("instruments"));
  for (std::size_t k = 0; k < instruments.size(); ++k) {
    if (k == series_.size())
      series_.push_back(begin(std::string(instruments[k].name), frame));
    append(series_[k], instruments[k]);
    show(series_[k], instruments[k], frame);
  }
}

} // namespace gewebe::formats
