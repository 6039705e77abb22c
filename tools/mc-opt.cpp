// mc-opt: volume -> triangle mesh of its isosurface, or tetrahedra of what lies inside.

#include "stuffing/stuffing.h"
#include "tools/cli/cli.h"
#include "tools/cli/space_option.h"
#include "tools/mesh/mesh_arguments.h"
#include "tools/mesh/mesh_work.h"

using namespace gewebe;

int main(int argc, char** argv) {
  cli::Program program("mc-opt",
                       "Turns a volume into a closed triangle mesh of its isosurface, with "
                       "fewer and better triangles than marching cubes alone; or into "
                       "tetrahedra that fill it.");
  cli::MeshArguments arguments;
  program.option("--iso", arguments.isovalue, "V", "isovalue; default: that of the volume");
  program
      .option("--epsilon", arguments.epsilon, "E",
              "merge points within E voxel edges of a voxel centre (default 0.15)")
      .range(0, 0.5);
  program
      .option("--place", arguments.place, "WHERE",
              "position of merged points: mean (default) or corner (voxel centre)")
      .one_of({"mean", "corner"});
  program.option("--resample", arguments.voxel, "S", "first resample the volume to voxels of S mm")
      .positive();
  program
      .option("--bbox", arguments.box, "X0,Y0,Z0,X1,Y1,Z1",
              "only what is in this box (mm), closed by its faces")
      .count(6);
  program
      .option("--components", arguments.components, "WHICH",
              "components to keep: largest, a number N, or min-volume:V (mm3)")
      .such_as({"largest", "1", "min-volume:"});
  program
      .option("--regularize", arguments.rounds, "N",
              "improve triangles in N rounds of flips and sliding")
      .range(0, 1000);
  program.flag("--normals", arguments.normals, "write normals from the gradient of the volume");
  program.flag("--self-intersections", arguments.self_intersections,
               "let --stats count pairs of triangles that intersect");
  program.flag("--tets", arguments.tets, "fill the inside with tetrahedra");
  program
      .option("--cell", arguments.cell, "S",
              "with --tets: cells of S mm, each of 12 tetrahedra (default: the voxel)")
      .positive();
  program.option("--refine", arguments.refine, "SELECTOR:SIZE[;...]",
                 "with --tets: cells of at most SIZE mm there, such as sphere:0,0,50,8:2");
  program.option("--grade", arguments.grade, "G", "with --tets: cells double inwards up to G times")
      .range(0, stuffing::stuffing_grade_max);
  program.option(
      "--materials", arguments.materials, "LABELS|VDB[,VDB...]",
      "with --tets: materials by labels, or 1, 2 … inside these volumes and 0 elsewhere");
  program
      .option("--interface", arguments.interface, "HOW",
              "with --materials: stair (default, faces of the lattice) or follow (smooth)")
      .one_of({"stair", "follow"});
  program.option("--label", arguments.labels, "L[-M][,L...]",
                 "with --materials LABELS: use these labels alone, such as 1,4-7");
  cli::declare_space(program, arguments.space);
  program.output_kinds(cli::writable_kinds());
  program.operand("VOLUME", arguments.volume, "OpenVDB volume");
  program.check([&] { cli::check(arguments); });
  return program.run(argc, argv, [&](cli::Run& run) {
    arguments.tets ? cli::mesh_solid(run, arguments) : cli::mesh_surface(run, arguments);
  });
}
