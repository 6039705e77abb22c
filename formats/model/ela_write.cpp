#include "base/parallel.h"
#include "formats/model/ela.h"
#include "formats/model/ela_internal.h"
#include "text/number_text.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <functional>
#include <vector>

namespace gewebe::formats {

namespace {

/// Appends words to a line of a preallocated block.
class LineWriter {
public:
  explicit LineWriter(std::string& text) : text_(text) {}

  template <class T>
  LineWriter& number(T value) {
    const auto end = std::to_chars(at_, line_.data() + line_.size(), value).ptr;
    at_ = end;
    *at_++ = ' ';
    return *this;
  }
  LineWriter& vector(const Vec3& v) { return number(v.x).number(v.y).number(v.z); }
  LineWriter& word(std::string_view word) {
    at_ = std::copy(word.begin(), word.end(), at_);
    *at_++ = ' ';
    return *this;
  }
  void end() {
    at_[-1] = '\n'; // in place of the last blank
    text_.append(line_.data(), at_);
    at_ = line_.data();
  }

private:
  std::string& text_;
  std::array<char, 256> line_; // 8 numbers of at most 24 characters
  char* at_ = line_.data();
};

using Sink = std::function<void(std::string_view)>;
using LineOf = std::function<void(std::size_t, LineWriter&)>;

/// A section's lines, made in blocks side by side, given to the sink in order while the next ones
/// are made.
void emit(const Sink& sink, const Context& context, std::string_view section, std::size_t count,
          const LineOf& line_of) {
  sink(std::string(section) + " " + std::to_string(count) + "\n");
  Context quiet = context;
  quiet.progress = nullptr; // the progress of parts of a section means nothing
  constexpr std::size_t grain = 4096, batch = 32;
  std::array<std::vector<std::string>, 2> blocks;
  const std::size_t all = (count + grain - 1) / grain;
  for (std::size_t begin = 0; begin < all + batch; begin += batch) {
    std::vector<std::string>&mine = blocks[begin / batch % 2],
    &ready = blocks[begin / batch % 2 ^ 1U];
    mine.resize(begin < all ? std::min(batch, all - begin) : 0);
    parallel_blocks(quiet, mine.size() + 1, 1, [&](std::size_t n, std::size_t) {
      if (n == 0) {
        for (const std::string& block : ready)
          sink(block);
        return;
      }
      std::string& block = mine[n - 1];
      block.clear();
      LineWriter line(block);
      const std::size_t first = (begin + n - 1) * grain;
      for (std::size_t i = first; i < std::min(count, first + grain); ++i)
        line_of(i, line);
    });
  }
}

void emit_skin(const Sink& sink, const model::Skin& skin, const Context& context) {
  emit(sink, context, "skin", skin.points.size(), [&](std::size_t i, LineWriter& line) {
    line.vector(skin.points[i]).number(skin.tetrahedron[i]).end();
  });
  emit(sink, context, "skin_triangles", skin.triangles.size(),
       [&](std::size_t i, LineWriter& line) {
         const Triangle& t = skin.triangles[i];
         line.number(t[0]).number(t[1]).number(t[2]).number(skin.material[i]).end();
       });
  if (!skin.texcoords.empty())
    emit(sink, context, "skin_texcoords", skin.texcoords.size(),
         [&](std::size_t i, LineWriter& line) {
           for (const double value : skin.texcoords[i])
             line.number(value);
           line.end();
         });
}

void emit_model(const Sink& sink, const model::Model& m, const Context& context,
                Space space = Space::unknown) {
  sink("ela_expl 1\nname \"" + m.name + "\"\n");
  if (space != Space::unknown)
    sink("space " + std::string(space_name(space)) + "\n");
  sink("materials " + std::to_string(m.materials.size()) + "\n");
  for (std::size_t i = 0; i < m.materials.size(); ++i) {
    const model::Material& k = m.materials[i];
    sink(std::to_string(i) + " \"" + k.name + "\" " + gewebe::text::number_text(k.density) + " " +
         gewebe::text::number_text(k.young) + " " + gewebe::text::number_text(k.thickness) + " " +
         gewebe::text::number_text(k.damping_ratio) +
         (k.poisson ? " " + gewebe::text::number_text(*k.poisson) : "") +
         (k.law ? " " + model::law_text(*k.law) : "") +
         (k.prony.empty() ? "" : " " + model::prony_text(k.prony)) + "\n");
  }
  emit(sink, context, "nodes", m.nodes.size(), [&](std::size_t i, LineWriter& line) {
    const model::Node& n = m.nodes[i];
    line.vector(n.position).number(n.mass).number(n.drag).word(model::fixed_axes_name(n.fixed));
    line.number(n.central).number(n.material).end();
  });
  if (!m.normals.empty())
    emit(sink, context, "normals", m.normals.size(),
         [&](std::size_t i, LineWriter& line) { line.vector(m.normals[i]).end(); });
  emit(sink, context, "springs", m.springs.size(), [&](std::size_t i, LineWriter& line) {
    const model::Spring& s = m.springs[i];
    line.number(s.i).number(s.j).word(kind_letters.substr(static_cast<std::size_t>(s.kind), 1));
    line.number(s.stiffness).number(s.damping).number(s.rest).end();
  });
  emit(sink, context, "triangles", m.triangles.size(), [&](std::size_t i, LineWriter& line) {
    const Triangle& t = m.triangles[i];
    line.number(t[0]).number(t[1]).number(t[2]).end();
  });
  if (!m.texcoords.empty())
    emit(sink, context, "texcoords", m.texcoords.size(), [&](std::size_t i, LineWriter& line) {
      for (const double value : m.texcoords[i])
        line.number(value);
      line.end();
    });
  if (!m.tetrahedra.empty())
    emit(sink, context, "tetrahedra", m.tetrahedra.size(), [&](std::size_t i, LineWriter& line) {
      for (const std::uint32_t corner : m.tetrahedra[i])
        line.number(corner);
      if (!m.middles.empty())
        for (const std::uint32_t middle : m.middles[i])
          line.number(middle);
      line.number(m.tetrahedron_material[i]).end();
    });
  if (!m.skin.points.empty())
    emit_skin(sink, m.skin, context);
  sink("end\n");
}

} // namespace

std::string ela_text(const model::Model& model) {
  std::string text;
  emit_model([&](std::string_view piece) { text += piece; }, model, Context{});
  return text;
}

void write_ela(Output& output, const model::Model& model, const Context& context, Space space) {
  emit_model([&](std::string_view piece) { output.write(piece); }, model, context, space);
}

} // namespace gewebe::formats
