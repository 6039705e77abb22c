// A program of one's own on the library: two soft balls become a volume, its surface, a deformable
// model, and that is pulled. Writes the model and the pulled surface, tells where node 0 has gone.
//
//     organ MODEL.ela PULLED.ply

#include "base/error.h"
#include "density/density.h"
#include "formats/mesh/ply.h"
#include "formats/model/ela.h"
#include "formats/stream/stream.h"
#include "model/build.h"
#include "statics/elastostatic.h"
#include "surface/snapping.h"

#include <cstdio>
#include <exception>

using namespace gewebe;

namespace {

void make_organ(const char* model_file, const char* mesh_file) {
  const Context context; // all threads, any memory, nobody to tell

  // Particles: a centre and the radius of the support, mm. Together they have one density.
  const Particles particles{{{0, 0, 0}, 12}, {{9, 0, 0}, 10}};
  density::DensityOptions lattice;
  lattice.info.transform = volume::uniform_transform(1); // voxels of 1 mm
  const volume::Grid volume = density::metaball_density(context, particles, lattice);

  // The surface where the density is 0.5, its small triangles merged; then masses and springs, of
  // the material of the first preset, held by four central nodes that can't move.
  const surface::IsoSurface surface = surface::marching_cubes_to_snap(context, volume);
  const TriangleMesh mesh = surface::snap(context, surface, {}).mesh;
  model::Model model = model::build_model(mesh, {}, context).model;
  model.name = "organ";

  // The stiffness is factorised once, then each load costs a solve or less.
  statics::Elastostatic organ(model, nullptr, context);
  contact::Load load;
  load.force[0] = {0, 0, 1000}; // on node 0, 1e-6 N
  organ.update(load);
  const std::span<const double> moved = organ.displacement(); // 3 numbers a node, mm

  TriangleMesh pulled = mesh;
  for (std::size_t i = 0; i < pulled.points.size(); ++i)
    pulled.points[i] += Vec3{moved[3 * i], moved[3 * i + 1], moved[3 * i + 2]};
  formats::Output text(model_file, {.binary = false}), binary(mesh_file, {});
  formats::write_ela(text, model, context);
  binary.write(formats::write_ply(pulled));
  text.commit();
  binary.commit();
  std::printf("%.9g %.9g %.9g\n", pulled.points[0].x, pulled.points[0].y, pulled.points[0].z);
}

} // namespace

int main(int argc, char** argv) {
  if (argc != 3)
    return 2;
  try {
    make_organ(argv[1], argv[2]);
  } catch (const std::exception& error) { // gewebe::Error, out of memory
    (void)std::fprintf(stderr, "organ: %s\n", error.what());
    return 1;
  }
  return 0;
}
