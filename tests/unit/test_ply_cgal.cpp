// CGAL reads the PLY that we write: the same points bit for bit, the same faces, a closed mesh.

#include "formats/mesh/ply.h"
#include "tests/unit/mesh_fixtures.h"

#include <CGAL/IO/PLY.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>

#include <gtest/gtest.h>

#include <sstream>

using namespace gewebe;

TEST(PlyCgal, ReadsWhatWeWrite) {
  using Point = CGAL::Simple_cartesian<double>::Point_3;
  const TriangleMesh mesh = test::sphere_mesh(2, 1.0 / 3, {0.1, 1e6, -1e-9});
  std::istringstream stream(formats::write_ply(mesh));
  std::vector<Point> points;
  std::vector<std::vector<std::size_t>> faces;
  ASSERT_TRUE(CGAL::IO::read_PLY(stream, points, faces));
  ASSERT_EQ(points.size(), mesh.points.size());
  for (std::size_t n = 0; n < points.size(); ++n)
    EXPECT_EQ((Vec3{points[n].x(), points[n].y(), points[n].z()}), mesh.points[n]);
  ASSERT_EQ(faces.size(), mesh.triangles.size());
  for (std::size_t f = 0; f < faces.size(); ++f)
    EXPECT_TRUE(std::ranges::equal(faces[f], mesh.triangles[f]));
  ASSERT_TRUE(CGAL::Polygon_mesh_processing::is_polygon_soup_a_polygon_mesh(faces));
  CGAL::Surface_mesh<Point> surface;
  CGAL::Polygon_mesh_processing::polygon_soup_to_polygon_mesh(points, faces, surface);
  EXPECT_TRUE(CGAL::is_closed(surface));
}
