#include "render/raster_cpu.h"

#include "base/parallel.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

// Based on: Pineda, A Parallel Algorithm for Polygon Rasterization, 1988 (edge functions);
// Sutherland and Hodgman, Reentrant Polygon Clipping, 1974; Heckbert and Moreton, Interpolation for
// Polygon Texture Mapping and Shading, 1991 (perspective correction).

namespace gewebe {
namespace {

// Screen coordinates are whole multiples of 1/4096 pixel, so that edge functions are exact in
// int64: pictures reach 2¹⁶ pixels, vertices beyond 2¹⁷ from the middle are cut off, and
// 2 · (2 · 2²⁹)² < 2⁶³.
constexpr int subpixel_bits = 12;
constexpr std::int64_t subpixels = std::int64_t{1} << subpixel_bits;
constexpr double guard_pixels = 131072 - 65536; // beyond the picture's edge
constexpr std::uint32_t band_rows = 16;
constexpr std::uint32_t nothing = UINT32_MAX;

struct ClipVertex {
  double x = 0, y = 0, w = 0;
  std::array<double, 5> attributes{}; // s, t, shifted s, shifted t, shade
};

struct ScreenVertex {
  std::int32_t x = 0, y = 0; // in subpixels, y downwards
  double inverse_w = 0;
  std::array<float, 5> attributes{};
};

/// From clip space to the picture.
class Viewport {
public:
  Viewport(const Projection& projection, std::uint32_t width, std::uint32_t height)
      : m_(projection.matrix), near_(projection.near), half_x_(width / 2.0), half_y_(height / 2.0),
        guard_x_(1 + guard_pixels / half_x_), guard_y_(1 + guard_pixels / half_y_) {}

  ClipVertex transform(const DrawVertex& v) const {
    const double x = v.position[0], y = v.position[1], z = v.position[2];
    const auto row = [&](const std::array<double, 4>& r) {
      return r[0] * x + r[1] * y + r[2] * z + r[3];
    };
    return {row(m_[0]),
            row(m_[1]),
            row(m_[3]),
            {v.st[0], v.st[1], v.shifted[0], v.shifted[1], v.shade}};
  }

  /// How far inside the planes near, left, right, bottom and top of the guard band; negative is
  /// outside.
  std::array<double, 5> guard_distances(const ClipVertex& v) const {
    return {v.w - near_, guard_x_ * v.w + v.x, guard_x_ * v.w - v.x, guard_y_ * v.w + v.y,
            guard_y_ * v.w - v.y};
  }

  /// One bit for each side of the view on whose far side the vertex lies.
  unsigned outside(const ClipVertex& v) const {
    return (v.w < near_ ? 1U : 0U) | (v.x < -v.w ? 2U : 0U) | (v.x > v.w ? 4U : 0U) |
           (v.y < -v.w ? 8U : 0U) | (v.y > v.w ? 16U : 0U);
  }

  ScreenVertex screen(const ClipVertex& v) const {
    ScreenVertex s;
    s.inverse_w = 1 / v.w;
    const double scale = static_cast<double>(subpixels);
    s.x = static_cast<std::int32_t>(std::floor((v.x * s.inverse_w + 1) * half_x_ * scale + 0.5));
    s.y = static_cast<std::int32_t>(std::floor((1 - v.y * s.inverse_w) * half_y_ * scale + 0.5));
    for (std::size_t a = 0; a < 5; ++a)
      s.attributes[a] = static_cast<float>(v.attributes[a]);
    return s;
  }

private:
  std::array<std::array<double, 4>, 4> m_;
  double near_, half_x_, half_y_, guard_x_, guard_y_;
};

bool inside_all(const std::array<double, 5>& distances) {
  return std::ranges::all_of(distances, [](double d) { return d >= 0; });
}

/// The part of a triangle inside the guard band, as a convex polygon. An edge is always cut from
/// its inner to its outer end, so that neighbours get the same points.
std::vector<ClipVertex> clipped(const Viewport& viewport, std::vector<ClipVertex> polygon) {
  for (std::size_t plane = 0; plane < 5 && polygon.size() >= 3; ++plane) {
    std::vector<ClipVertex> kept;
    for (std::size_t n = 0; n < polygon.size(); ++n) {
      const ClipVertex& a = polygon[n];
      const ClipVertex& b = polygon[(n + 1) % polygon.size()];
      const double da = viewport.guard_distances(a)[plane];
      const double db = viewport.guard_distances(b)[plane];
      if (da >= 0)
        kept.push_back(a);
      if ((da >= 0) == (db >= 0))
        continue;
      const ClipVertex& in = da >= 0 ? a : b;
      const ClipVertex& out = da >= 0 ? b : a;
      const double part = da >= 0 ? da / (da - db) : db / (db - da);
      ClipVertex cut{in.x + part * (out.x - in.x),
                     in.y + part * (out.y - in.y),
                     in.w + part * (out.w - in.w),
                     {}};
      for (std::size_t c = 0; c < cut.attributes.size(); ++c)
        cut.attributes[c] = in.attributes[c] + part * (out.attributes[c] - in.attributes[c]);
      kept.push_back(cut);
    }
    polygon = std::move(kept);
  }
  return polygon;
}

std::int64_t ceil_div(std::int64_t a, std::int64_t b) { // b > 0
  return a >= 0 ? (a + b - 1) / b : -(-a / b);
}
std::int64_t floor_div(std::int64_t a, std::int64_t b) { // b > 0
  return a >= 0 ? a / b : -((-a + b - 1) / b);
}

/// A triangle on the screen, counter-clockwise in its own way: its edge functions are positive
/// inside. Edge k is opposite corner k.
struct ScreenTriangle {
  Triangle vertex{};
  std::int32_t left = 0, right = -1, top = 0, bottom = -1; // pixels whose centres it may own
};

/// E(x, y) = c + dx · x + dy · y at the centre of pixel (x, y), in subpixels².
struct EdgeFunctions {
  std::array<std::int64_t, 3> c{}, dx{}, dy{};
  std::array<bool, 3> owns{}; // a top or left edge: its points belong to the triangle
  std::int64_t area = 0;      // twice the triangle's

  EdgeFunctions(const ScreenVertex& v0, const ScreenVertex& v1, const ScreenVertex& v2) {
    const std::array<const ScreenVertex*, 3> v{&v0, &v1, &v2};
    for (std::size_t k = 0; k < 3; ++k) {
      const ScreenVertex &a = *v[(k + 1) % 3], &b = *v[(k + 2) % 3];
      const std::int64_t ex = std::int64_t{b.x} - a.x, ey = std::int64_t{b.y} - a.y;
      // ex (y - a.y) - ey (x - a.x), with x and y at the centres of pixels
      dx[k] = -ey * subpixels;
      dy[k] = ex * subpixels;
      c[k] = ex * (subpixels / 2 - a.y) - ey * (subpixels / 2 - a.x);
      owns[k] = ey < 0 || (ey == 0 && ex > 0);
    }
    area = (std::int64_t{v1.x} - v0.x) * (std::int64_t{v2.y} - v0.y) -
           (std::int64_t{v1.y} - v0.y) * (std::int64_t{v2.x} - v0.x);
  }

  std::int64_t at(std::size_t k, std::int64_t x, std::int64_t y) const {
    return c[k] + dx[k] * x + dy[k] * y;
  }

  /// The pixels of row y that the triangle owns, between `left` and `right`.
  void span(std::int64_t y, std::int64_t& left, std::int64_t& right) const {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::int64_t start = c[k] + dy[k] * y - (owns[k] ? 0 : 1); // + dx x >= 0
      if (dx[k] > 0)
        left = std::max(left, ceil_div(-start, dx[k]));
      else if (dx[k] < 0)
        right = std::min(right, floor_div(start, -dx[k]));
      else if (start < 0)
        right = left - 1;
    }
  }
};

struct Screen {
  std::vector<ScreenVertex> vertices;
  std::vector<ScreenTriangle> triangles;
};

/// Orients and bounds the triangle; false if it owns no pixel of the picture for sure.
bool place(ScreenTriangle& t, const std::vector<ScreenVertex>& vertices, std::int32_t width,
           std::int32_t height) {
  const ScreenVertex &a = vertices[t.vertex[0]], &b = vertices[t.vertex[1]],
                     &c = vertices[t.vertex[2]];
  const std::int64_t area = EdgeFunctions(a, b, c).area;
  if (area == 0)
    return false;
  if (area < 0)
    std::swap(t.vertex[1], t.vertex[2]);
  // The centre of pixel p is at (p + 1/2) subpixels.
  const auto first = [](std::int32_t low) {
    return static_cast<std::int32_t>(ceil_div(std::int64_t{low} - subpixels / 2, subpixels));
  };
  const auto last = [](std::int32_t high) {
    return static_cast<std::int32_t>(floor_div(std::int64_t{high} - subpixels / 2, subpixels));
  };
  t.left = std::max(0, first(std::min({a.x, b.x, c.x})));
  t.right = std::min(width - 1, last(std::max({a.x, b.x, c.x})));
  t.top = std::max(0, first(std::min({a.y, b.y, c.y})));
  t.bottom = std::min(height - 1, last(std::max({a.y, b.y, c.y})));
  return t.left <= t.right && t.top <= t.bottom;
}

Screen project(const Drawing& drawing, const Projection& projection, std::uint32_t width,
               std::uint32_t height, const Context& context) {
  constexpr std::size_t grain = 4096;
  enum class Fate : std::uint8_t { draw, clip, drop };
  const Viewport viewport(projection, width, height);
  Screen screen;
  screen.vertices.resize(drawing.vertices.size());
  std::vector<std::uint8_t> outside(drawing.vertices.size()); // 32: beyond the guard band
  parallel_blocks(context, drawing.vertices.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) {
      const ClipVertex clip = viewport.transform(drawing.vertices[v]);
      outside[v] = static_cast<std::uint8_t>(viewport.outside(clip));
      if (inside_all(viewport.guard_distances(clip)))
        screen.vertices[v] = viewport.screen(clip);
      else
        outside[v] |= 32U;
    }
  });

  std::vector<ScreenTriangle> placed(drawing.triangles.size());
  std::vector<Fate> fates(drawing.triangles.size());
  const auto w = static_cast<std::int32_t>(width), h = static_cast<std::int32_t>(height);
  parallel_blocks(context, placed.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      const Triangle& t = drawing.triangles[n];
      const unsigned a = outside[t[0]], b = outside[t[1]], c = outside[t[2]];
      placed[n].vertex = t;
      if ((a & b & c & 31U) != 0)
        fates[n] = Fate::drop;
      else if (((a | b | c) & 32U) != 0)
        fates[n] = Fate::clip;
      else
        fates[n] = place(placed[n], screen.vertices, w, h) ? Fate::draw : Fate::drop;
    }
  });

  for (std::size_t n = 0; n < placed.size(); ++n) {
    if (fates[n] == Fate::draw)
      screen.triangles.push_back(placed[n]);
    if (fates[n] != Fate::clip)
      continue;
    const Triangle& t = placed[n].vertex;
    const std::vector<ClipVertex> polygon =
        clipped(viewport, {viewport.transform(drawing.vertices[t[0]]),
                           viewport.transform(drawing.vertices[t[1]]),
                           viewport.transform(drawing.vertices[t[2]])});
    const auto first = static_cast<std::uint32_t>(screen.vertices.size());
    for (const ClipVertex& v : polygon)
      screen.vertices.push_back(viewport.screen(v));
    for (std::uint32_t k = 2; k < polygon.size(); ++k) {
      ScreenTriangle part;
      part.vertex = {first, first + k - 1, first + k};
      if (place(part, screen.vertices, w, h))
        screen.triangles.push_back(part);
    }
  }
  return screen;
}

/// Some rows of the picture: which triangle is seen in each pixel, then its colours.
class Band {
public:
  Band(const Screen& screen, const Look& look, Image& image, std::uint32_t top, std::uint32_t rows)
      : screen_(screen), look_(look), image_(image), top_(top), rows_(rows),
        seen_(std::size_t{image.width} * rows, nothing), nearness_(seen_.size()) {}

  std::uint64_t draw() {
    for (std::uint32_t n = 0; n < screen_.triangles.size(); ++n)
      cover(n);
    return shade();
  }

private:
  EdgeFunctions edges(const ScreenTriangle& t) const {
    return {screen_.vertices[t.vertex[0]], screen_.vertices[t.vertex[1]],
            screen_.vertices[t.vertex[2]]};
  }

  void cover(std::uint32_t n) {
    const ScreenTriangle& t = screen_.triangles[n];
    const auto top = static_cast<std::int32_t>(top_);
    const std::int32_t from = std::max(t.top, top),
                       to = std::min(t.bottom, top + static_cast<std::int32_t>(rows_) - 1);
    if (from > to)
      return;
    const EdgeFunctions e = edges(t);
    std::array<double, 3> inverse_w{};
    for (std::size_t k = 0; k < 3; ++k)
      inverse_w[k] = screen_.vertices[t.vertex[k]].inverse_w / static_cast<double>(e.area);
    for (std::int32_t y = from; y <= to; ++y) {
      std::int64_t left = t.left, right = t.right;
      e.span(y, left, right);
      const std::size_t row = static_cast<std::size_t>(y - top) * image_.width;
      for (std::int64_t x = left; x <= right; ++x) {
        // 1 / w is linear on the screen: the larger the nearer.
        const double nearness = static_cast<double>(e.at(0, x, y)) * inverse_w[0] +
                                static_cast<double>(e.at(1, x, y)) * inverse_w[1] +
                                static_cast<double>(e.at(2, x, y)) * inverse_w[2];
        const std::size_t at = row + static_cast<std::size_t>(x);
        if (nearness > nearness_[at]) {
          nearness_[at] = nearness;
          seen_[at] = n;
        }
      }
    }
  }

  std::uint64_t shade() {
    const std::array<std::uint8_t, 3> background = stored(look_.background);
    std::uint8_t* out = &image_.values[std::size_t{3} * image_.width * top_];
    std::uint64_t covered = 0;
    for (std::size_t at = 0; at < seen_.size(); ++at, out += 3) {
      if (seen_[at] == nothing) {
        std::copy(background.begin(), background.end(), out);
        continue;
      }
      ++covered;
      const ScreenTriangle& t = screen_.triangles[seen_[at]];
      const auto color = color_of(t, edges(t), static_cast<std::int64_t>(at % image_.width),
                                  static_cast<std::int64_t>(top_ + at / image_.width));
      std::copy(color.begin(), color.end(), out);
    }
    return covered;
  }

  std::array<std::uint8_t, 3> color_of(const ScreenTriangle& t, const EdgeFunctions& e,
                                       std::int64_t x, std::int64_t y) const {
    std::array<double, 5> attributes{};
    double sum = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const ScreenVertex& v = screen_.vertices[t.vertex[k]];
      const double weight = static_cast<double>(e.at(k, x, y)) * v.inverse_w;
      sum += weight;
      for (std::size_t a = 0; a < 5; ++a)
        attributes[a] += weight * static_cast<double>(v.attributes[a]);
    }
    for (double& a : attributes)
      a /= sum;
    const auto& [s, t_, shifted_s, shifted_t, shade] = attributes;
    Vec3 color = look_.color;
    if (look_.base) {
      const std::array<double, 3> texel = sample(*look_.base, s, t_);
      color = {color.x * texel[0], color.y * texel[1], color.z * texel[2]};
    }
    double r = 0.5;
    if (look_.structure)
      r = relief(sample(*look_.structure, s, t_)[0],
                 sample(*look_.structure, shifted_s, shifted_t)[0]);
    return {stored(compose(color.x * shade, r)), stored(compose(color.y * shade, r)),
            stored(compose(color.z * shade, r))};
  }

  const Screen& screen_;
  const Look& look_;
  Image& image_;
  std::uint32_t top_, rows_;
  std::vector<std::uint32_t> seen_;
  std::vector<double> nearness_;
};

} // namespace

Image render_cpu(const Drawing& drawing, const Projection& projection, const Look& look,
                 std::uint32_t width, std::uint32_t height, const Context& context,
                 RenderReport* report) {
  const Screen screen = project(drawing, projection, width, height, context);
  Image image{width, height, 3, {}};
  image.values.resize(std::size_t{3} * width * height);
  std::vector<std::uint64_t> covered((height + band_rows - 1) / band_rows);
  parallel_blocks(context, height, band_rows, [&](std::size_t begin, std::size_t end) {
    Band band(screen, look, image, static_cast<std::uint32_t>(begin),
              static_cast<std::uint32_t>(end - begin));
    covered[begin / band_rows] = band.draw();
  });
  if (report != nullptr) {
    report->triangles = screen.triangles.size();
    report->covered = 0;
    for (const std::uint64_t count : covered)
      report->covered += count;
  }
  return image;
}

double render_cpu_bytes(std::uint32_t width, std::uint32_t height, const Context& context) {
  return 3.0 * width * height + 12.0 * width * band_rows * thread_count(context);
}

} // namespace gewebe
