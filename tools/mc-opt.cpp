// mc-opt: volume -> triangle mesh of its isosurface, or tetrahedra of what lies inside.

#include "stuffing/stuffing.h"
#include "tools/mesh/mesh_arguments.h"
#include "tools/mesh/mesh_work.h"
#include "tools/shared/cli.h"
#include "tools/shared/space_option.h"

using namespace gewebe;

int main(int argc, char** argv) {
  cli::Program program("mc-opt",
                       "Turns a volume into a closed triangle mesh of its isosurface, with "
                       "fewer and better triangles than marching cubes alone; or into "
                       "tetrahedra that fill it.");
  MeshArguments arguments;
  program.option("--iso", arguments.isovalue, "V",
                 "inside is above V (in a level set: below); default: the volume's own");
  program
      .option("--epsilon", arguments.epsilon, "E",
              "merge points within E voxel edges of a voxel centre (default 0.15)")
      .range(0, 0.5);
  program
      .option("--place", arguments.place, "WHERE",
              "put merged points at their mean (default) or at the voxel centre (corner)")
      .one_of({"mean", "corner"});
  program.option("--resample", arguments.voxel, "S", "first bring the volume to voxels of S mm")
      .positive();
  program
      .option("--bbox", arguments.box, "X0,Y0,Z0,X1,Y1,Z1",
              "only what lies in this box of the world, closed by its faces")
      .count(6);
  program
      .option("--components", arguments.components, "WHICH",
              "keep only the largest components: largest, a number N, or min-volume:V mm3")
      .such_as({"largest", "1", "min-volume:"});
  program
      .option("--regularize", arguments.rounds, "N",
              "improve the triangles by N rounds of flips and sliding along the surface")
      .range(0, 1000);
  program.flag("--normals", arguments.normals, "write normals, from the gradient of the volume");
  program.flag("--self-intersections", arguments.self_intersections,
               "let --stats count the pairs of faces that cut each other");
  program.flag("--tets", arguments.tets, "fill the inside with tetrahedra");
  program
      .option("--cell", arguments.cell, "S",
              "with --tets: cells of S mm, each of 12 tetrahedra (default: the voxel)")
      .positive();
  program
      .option("--grade", arguments.grade, "G",
              "with --tets: cells double inwards up to G times, the boundary stays")
      .range(0, stuffing_grade_max);
  program.option("--materials", arguments.materials, "LABELS|VDB[,VDB...]",
                 "with --tets: material by the label of a label volume; or 1, 2 … where a volume's "
                 "inside is, else 0");
  program
      .option("--interface", arguments.interface, "HOW",
              "with --materials: faces of the lattice (stair, default), or cut (follow)")
      .one_of({"stair", "follow"});
  program.option("--label", arguments.labels, "L[-M][,L...]",
                 "with --materials LABELS: these labels alone, each tetrahedron the nearest");
  declare_space(program, arguments.space);
  program.output_kinds(writable_kinds());
  program.operand("VOLUME", arguments.volume, "OpenVDB volume");
  program.check([&] { check(arguments); });
  return program.run(argc, argv, [&](cli::Run& run) {
    arguments.tets ? mesh_solid(run, arguments) : mesh_surface(run, arguments);
  });
}
