#include "mesh/face_figures.h"

#include "base/huge_pages.h"
#include "base/parallel.h"
#include "mesh/edges.h"

#include <algorithm>
#include <cmath>

namespace gewebe::mesh {
namespace {

constexpr double degrees = 57.295779513082320877;
constexpr std::size_t grain = 1 << 15;

/// Tangents of 5, 10 … 55 degrees.
constexpr std::array<double, 11> tangents_of_bins{
    0.08748866352592401, 0.17632698070846498, 0.26794919243112270,
    0.36397023426620234, 0.46630765815499859, 0.57735026918962576,
    0.70020753820970978, 0.83909963117728001, 1.0,
    1.19175359259420996, 1.42814800674211450};

/// Equal bins of tangents, to count angles in and to find ranks.
constexpr std::size_t fine_bins = 4096;
constexpr double fine_scale = fine_bins / 1.7320508075688773; // no smallest angle is above 60
std::size_t fine_bin(double tangent) {
  return static_cast<std::size_t>(
      static_cast<std::int32_t>(std::min(tangent * fine_scale, fine_bins - 1.0)));
}

/// The angles of a block of faces, counted.
struct AngleCounts {
  std::array<std::uint32_t, fine_bins> fine{};
  std::array<std::uint32_t, 12> bins{};
};

class AngleCounter {
public:
  AngleCounter() {
    for (std::size_t b = 0; b < tangents_of_bins.size(); ++b)
      for (std::size_t n = fine_bin(tangents_of_bins[b]) + 1; n < fine_bins; ++n)
        below_[n] = static_cast<std::uint8_t>(b + 1);
    std::ranges::copy(tangents_of_bins, next_.begin());
    next_.back() = HUGE_VAL;
  }
  void count(double tangent, AngleCounts& counts) const {
    const std::size_t fine = fine_bin(tangent), bin = below_[fine];
    ++counts.fine[fine];
    ++counts.bins[bin + (tangent >= next_[bin] ? 1U : 0U)];
  }

private:
  /// Of each fine bin how many borders lie below it; another one may lie in it.
  std::array<std::uint8_t, fine_bins> below_{};
  std::array<double, 12> next_{};
};

using Ranks = std::array<std::uint64_t, 3>;

/// The tangents that a sort would bring to these ranks.
std::array<double, 3> ranked(std::span<const double> tangents,
                             const std::vector<AngleCounts>& counts, const Ranks& ranks,
                             const Context& context) {
  std::array<double, 3> found{};
  Ranks within = ranks; // the bin
  std::array<std::size_t, 3> bins{};
  for (std::size_t r = 0; r < ranks.size(); ++r)
    for (;; ++bins[r]) {
      std::uint64_t here = 0;
      for (const AngleCounts& some : counts)
        here += some.fine[bins[r]];
      if (within[r] < here)
        break;
      within[r] -= here;
    }
  std::vector<std::array<std::vector<double>, 3>> inside(counts.size());
  parallel_blocks(context, tangents.size(), grain, [&](std::size_t begin, std::size_t end) {
    auto& mine = inside[begin / grain];
    for (const double tangent : tangents.subspan(begin, end - begin)) {
      if (tangent < 0)
        continue;
      const std::size_t bin = fine_bin(tangent);
      for (std::size_t r = 0; r < ranks.size(); ++r)
        if (bin == bins[r])
          mine[r].push_back(tangent);
    }
  });
  for (std::size_t r = 0; r < ranks.size(); ++r) {
    std::vector<double> all;
    for (const auto& some : inside)
      all.insert(all.end(), some[r].begin(), some[r].end());
    const auto at = all.begin() + static_cast<std::ptrdiff_t>(within[r]);
    std::ranges::nth_element(all, at);
    found[r] = *at;
  }
  return found;
}

AngleFigures angle_figures(std::span<const double> tangents, const std::vector<AngleCounts>& counts,
                           const Context& context) {
  AngleFigures angles;
  angles.smallest_angles = {60, std::vector<std::uint64_t>(12)};
  std::uint64_t faces = 0;
  for (const AngleCounts& some : counts)
    for (std::size_t b = 0; b < 12; ++b) {
      angles.smallest_angles.counts[b] += some.bins[b];
      faces += some.bins[b];
    }
  if (faces == 0)
    return angles;
  angles.share_below_10 =
      static_cast<double>(angles.smallest_angles.counts[0] + angles.smallest_angles.counts[1]) /
      static_cast<double>(faces);
  const auto found = ranked(tangents, counts, {faces / 100, faces / 20, faces / 2}, context);
  angles.at_1_percent = std::atan(found[0]) * degrees;
  angles.at_5_percent = std::atan(found[1]) * degrees;
  angles.median = std::atan(found[2]) * degrees;
  return angles;
}

struct Part {
  std::uint64_t degenerate = 0, zero_area = 0;
  double area = 0, area_max = 0, tangent_min = HUGE_VAL;
  std::vector<FaceFigures::Run> runs;
};

/// What faces are counted in.
struct Shapes {
  std::span<float> areas;
  std::span<double> tangents;
};

Part examine_block(const TriangleMesh& mesh, const std::vector<std::uint32_t>& component,
                   std::size_t begin, std::size_t end, const Shapes& shapes,
                   const AngleCounter& counter, AngleCounts& counts) {
  Part part;
  FaceFigures::Run run;
  Vec3 origin;
  run.component = UINT32_MAX; // none
  for (std::size_t f = begin; f < end; ++f) {
    const Triangle& t = mesh.triangles[f];
    if (has_equal_corners(t)) {
      ++part.degenerate;
      shapes.areas[f] = -1;
      shapes.tangents[f] = -1;
      continue;
    }
    const Vec3 &a = mesh.points[t[0]], &b = mesh.points[t[1]], &c = mesh.points[t[2]];
    const Vec3 u = b - a, v = c - a, w = c - b, normal = cross(u, v);
    const double uu = dot(u, u), vv = dot(v, v), ww = dot(w, w);
    const double square = dot(normal, normal), twice_area = std::sqrt(square);
    // The smallest angle lies between the two longer sides. (Chosen without branches.)
    const double at_u = dot(v, w), at_v = -dot(u, w), at_w = dot(u, v);
    double shortest = uu, along = at_u;
    along = vv < shortest ? at_v : along;
    shortest = std::min(shortest, vv);
    along = ww < shortest ? at_w : along;
    const double tangent = twice_area > 0 ? twice_area / along : 0, area = twice_area / 2;
    shapes.areas[f] = static_cast<float>(area);
    shapes.tangents[f] = tangent;
    counter.count(tangent, counts);
    part.area += area;
    part.area_max = std::max(part.area_max, area);
    part.tangent_min = std::min(part.tangent_min, tangent);
    part.zero_area += twice_area > 2e-12 * std::max(uu, std::max(vv, ww)) ? 0U : 1U;
    if (const std::uint32_t root = component[t[0]]; root != run.component) {
      if (run.component != UINT32_MAX)
        part.runs.push_back(run);
      run = {root, static_cast<std::uint32_t>(f), square, 0};
      origin = mesh.points[root];
    }
    if (square > run.square) {
      run.square = square;
      run.largest = static_cast<std::uint32_t>(f);
    }
    run.six_volumes += dot(a - origin, normal);
  }
  if (run.component != UINT32_MAX)
    part.runs.push_back(run);
  return part;
}

} // namespace

FaceFigures examine_faces(const TriangleMesh& mesh, const std::vector<std::uint32_t>& component,
                          const Context& context) {
  const std::size_t count = mesh.triangles.size(), blocks = (count + grain - 1) / grain;
  FaceFigures all;
  std::vector<double> tangents;
  resize_all(context, resizing(all.areas, count), resizing(tangents, count));
  std::vector<Part> parts(blocks);
  std::vector<AngleCounts> counts(blocks);
  const AngleCounter counter;
  parallel_blocks(context, count, grain, [&](std::size_t begin, std::size_t end) {
    parts[begin / grain] = examine_block(mesh, component, begin, end, {all.areas, tangents},
                                         counter, counts[begin / grain]);
  });
  double tangent_min = HUGE_VAL;
  for (const Part& part : parts) {
    all.degenerate += part.degenerate;
    all.zero_area += part.zero_area;
    all.area += part.area;
    all.area_max = std::max(all.area_max, part.area_max);
    tangent_min = std::min(tangent_min, part.tangent_min);
    all.runs.insert(all.runs.end(), part.runs.begin(), part.runs.end());
  }
  all.smallest_angle = all.degenerate == count ? 180
                       : all.zero_area > 0     ? 0
                                               : std::atan(tangent_min) * degrees;
  all.angles = angle_figures(tangents, counts, context);
  return all;
}

Histogram histogram(std::span<const std::span<const float>> pieces, std::size_t bins, double top,
                    const Context& context) {
  const double divisor = top > 0 ? top : 1, last = static_cast<double>(bins) - 1;
  std::vector<std::vector<std::uint64_t>> counts(pieces.size());
  parallel_blocks(context, pieces.size(), 1, [&](std::size_t n, std::size_t) {
    std::vector<std::uint64_t> mine(bins);
    for (const float value : pieces[n]) {
      const double bin = std::min(value / divisor * static_cast<double>(bins), last);
      if (!(value < 0))
        ++mine[static_cast<std::size_t>(static_cast<std::int32_t>(bin))];
    }
    counts[n] = std::move(mine);
  });
  Histogram result{top, std::vector<std::uint64_t>(bins, 0)};
  for (const std::vector<std::uint64_t>& some : counts)
    for (std::size_t b = 0; b < bins; ++b)
      result.counts[b] += some[b];
  return result;
}

} // namespace gewebe::mesh
