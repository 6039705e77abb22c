#include "formats/volume/dense_image.h"

#include "base/error.h"
#include "formats/volume/gzip_internal.h"
#include "formats/volume/nifti_field.h"
#include "formats/volume/nifti_header_internal.h"
#include "text/number_text.h"

#include <zlib.h>

#include <array>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace gewebe::formats {
namespace {

using Sink = std::function<void(std::string_view)>;

struct Box {
  Int3 min{}, size{};
};

/// The box of active voxels with a margin. \throw Error
Box image_box(const volume::Grid& grid, const std::string& name, Kind kind) {
  Int3 min{}, max{};
  if (!grid.active_box(min, max))
    throw Error(name, "the volume has no active voxel, so that an image of it has no size; "
                      "expected one, or an OpenVDB file");
  Box box;
  double voxels = 1;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::int64_t size = std::int64_t{max[axis]} - min[axis] + 3;
    if (kind == Kind::nifti && size > nifti_longest)
      throw Error(name, "NIfTI has up to 32767 voxels along an axis, not " + std::to_string(size) +
                            ", expected nrrd or mha");
    voxels *= static_cast<double>(size);
    box.min[axis] = min[axis] - 1;
    box.size[axis] = static_cast<std::int32_t>(size);
  }
  if (voxels > 8589934592.0)
    throw Error(name, "an image of the volume has more than 2^33 voxels, expected an OpenVDB file "
                      "or larger voxels");
  return box;
}

/// Transform of the image's first voxel as index 0, in its own space.
volume::GridTransform image_transform(const volume::Grid& grid, const Box& box, bool other) {
  volume::GridTransform t = grid.info().transform;
  const Vec3 first = t.to_world({static_cast<double>(box.min[0]), static_cast<double>(box.min[1]),
                                 static_cast<double>(box.min[2])});
  for (std::size_t row = 0; row < 3; ++row) {
    t.m[4 * row + 3] = first[static_cast<int>(row)];
    for (std::size_t k = 0; other && row < 2 && k < 4; ++k)
      t.m[4 * row + k] = 0 - t.m[4 * row + k];
  }
  return t;
}

void write_voxels(const volume::Grid& grid, const Box& box, const Sink& sink) {
  volume::GridAccessor values(grid);
  std::vector<float> slice(static_cast<std::size_t>(box.size[0]) *
                           static_cast<std::size_t>(box.size[1]));
  for (std::int32_t z = 0; z < box.size[2]; ++z) {
    std::size_t at = 0;
    for (std::int32_t y = 0; y < box.size[1]; ++y)
      for (std::int32_t x = 0; x < box.size[0]; ++x)
        slice[at++] = values.value({box.min[0] + x, box.min[1] + y, box.min[2] + z});
    sink({reinterpret_cast<const char*>(slice.data()), slice.size() * sizeof(float)});
  }
}

void write_packed(const volume::Grid& grid, const Box& box, bool compressed, std::string_view head,
                  bool head_too, const Sink& sink) {
  if (!compressed) {
    sink(head);
    return write_voxels(grid, box, sink);
  }
  if (!head_too)
    sink(head);
  GzipWriter packed(sink);
  if (head_too)
    packed.write(head);
  write_voxels(grid, box, [&](std::string_view bytes) { packed.write(bytes); });
  packed.finish();
}

std::string numbers(const std::array<double, 3>& values, const char* between) {
  return gewebe::text::number_text(values[0]) + between + gewebe::text::number_text(values[1]) +
         between + gewebe::text::number_text(values[2]);
}

std::array<double, 3> column(const volume::GridTransform& t, std::size_t axis, double over = 1) {
  return {t.m[axis] / over, t.m[4 + axis] / over, t.m[8 + axis] / over};
}

std::string sizes_text(const Int3& size) {
  return std::to_string(size[0]) + " " + std::to_string(size[1]) + " " + std::to_string(size[2]);
}

/// NRRD 4 (teem.sourceforge.net/nrrd/format.html).
std::string nrrd_head(const Box& box, const volume::GridTransform& t,
                      const DenseImageOptions& options) {
  const auto vector = [&](std::size_t axis) { return "(" + numbers(column(t, axis), ",") + ")"; };
  return std::string("NRRD0004\ntype: float\ndimension: 3\nspace: ") +
         (options.space == Space::lps ? "left-posterior-superior" : "right-anterior-superior") +
         "\nsizes: " + sizes_text(box.size) + "\nspace directions: " + vector(0) + " " + vector(1) +
         " " + vector(2) + "\nkinds: domain domain domain\nendian: little\nencoding: " +
         (options.compressed ? "gzip" : "raw") +
         "\nspace units: \"mm\" \"mm\" \"mm\"\nspace origin: " + vector(3) + "\n\n";
}

/// MetaImage (itk.org/Wiki/MetaIO/Documentation): LPS, directions of axes one after the other.
std::string meta_head(const Box& box, const volume::GridTransform& t, bool compressed,
                      std::size_t bytes) {
  const Vec3 size = t.voxel_size();
  std::string head = "ObjectType = Image\nNDims = 3\nBinaryData = True\n"
                     "BinaryDataByteOrderMSB = False\n";
  head += compressed ? "CompressedData = True\nCompressedDataSize = " + std::to_string(bytes) + "\n"
                     : "CompressedData = False\n";
  head += "TransformMatrix = " + numbers(column(t, 0, size.x), " ") + " " +
          numbers(column(t, 1, size.y), " ") + " " + numbers(column(t, 2, size.z), " ");
  head += "\nOffset = " + numbers(column(t, 3), " ") + "\nCenterOfRotation = 0 0 0";
  head += "\nElementSpacing = " + numbers({size.x, size.y, size.z}, " ");
  return head + "\nDimSize = " + sizes_text(box.size) +
         "\nElementType = MET_FLOAT\nElementDataFile = LOCAL\n";
}

/// The voxels as one zlib stream, whose size the head states.
std::string packed_voxels(const volume::Grid& grid, const Box& box) {
  z_stream stream{};
  if (deflateInit(&stream, 6) != Z_OK)
    throw Error("zlib can't begin to pack, expected memory for it");
  std::string packed;
  std::vector<char> out(std::size_t{1} << 20);
  const auto pack = [&](std::string_view bytes, int flush) {
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
    stream.avail_in = static_cast<uInt>(bytes.size());
    do {
      stream.next_out = reinterpret_cast<Bytef*>(out.data());
      stream.avail_out = static_cast<uInt>(out.size());
      (void)deflate(&stream, flush);
      packed.append(out.data(), out.size() - stream.avail_out);
    } while (stream.avail_out == 0);
  };
  write_voxels(grid, box, [&](std::string_view bytes) { pack(bytes, Z_NO_FLUSH); });
  pack({}, Z_FINISH);
  deflateEnd(&stream);
  return packed;
}

} // namespace

const std::vector<Kind>& dense_image_kinds() {
  static const std::vector<Kind> kinds{Kind::nifti, Kind::nrrd, Kind::mha};
  return kinds;
}

Int3 write_dense_image(Output& output, const volume::Grid& grid, const DenseImageOptions& options) {
  const Box box = image_box(grid, output.name(), options.kind);
  const Space wanted = options.kind == Kind::nifti ? Space::ras
                       : options.kind == Kind::mha ? Space::lps
                                                   : options.space;
  const volume::GridTransform t = image_transform(grid, box, options.space != wanted);
  const Sink sink = [&](std::string_view bytes) { output.write(bytes); };
  if (options.kind == Kind::nifti) {
    const NiftiHeader head =
        nifti_header({3, box.size[0], box.size[1], box.size[2], 1, 1, 1, 1}, 0, t, "gewebe");
    write_packed(grid, box, options.compressed, head.bytes(), true, sink);
  } else if (options.kind == Kind::nrrd) {
    write_packed(grid, box, options.compressed, nrrd_head(box, t, options), false, sink);
  } else if (options.compressed) {
    const std::string packed = packed_voxels(grid, box);
    sink(meta_head(box, t, true, packed.size()));
    sink(packed);
  } else {
    sink(meta_head(box, t, false, 0));
    write_voxels(grid, box, sink);
  }
  return box.size;
}

} // namespace gewebe::formats
