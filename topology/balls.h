#pragma once
#include <filesystem>
#include <string_view>
#include <vector>

#include "geometry/mesh.h"
#include "topology/section.h"

namespace geocage::topology {

/// hop: number of edges x mean edge length (thesis 3.3); dijkstra: lengths of edges.
enum class Metric { hop, dijkstra };

/// All that the ball of radius r around each vertex says, one entry a vertex.
struct BallFields {
  double radius_m = 0;
  std::vector<double> curvature_sum_rad;  ///< S2: sum of angle defects over the ball's vertices
  std::vector<double> winding_angle_rad;  ///< S1: in [pi, 2 pi]; NaN where there is no dominant axis
  std::vector<double>
      accumulated_angle_rad;  ///< what the section runs through in all its turns; NaN as above
  std::vector<int> ball_vertices, ball_triangles, euler;
  std::vector<double> ball_area_m2;
  std::vector<Vec3> center, axis;  ///< Z, and the unit principal axis A (zero where there is none)

  static BallFields of_size(std::size_t vertices, double radius_m);
};

/// Median over the vertices of the share of the surface's area that their balls hold: above a half, balls say
/// the same everywhere and can't be ranked.
double median_share(const BallFields& ball, double surface_area_m2);

/// The balls of one mesh at each radius, in the order they were asked for.
struct BallSet {
  std::vector<BallFields> radii;
};

/// K = 2 pi minus the angles of the triangles around each vertex (angle defect, thesis 3.4). Precondition:
/// closed.
std::vector<double> angle_defects_rad(const geometry::TriangleMesh& mesh);

/// The path that is measured: the cut of the plane with the triangles, or the mesh edges along it
/// (thesis 3.5).
enum class SectionPath { plane, edges };

struct BallOptions {
  double eigenvalue_ratio_guard = 1.1;  ///< an axis is dominant when its eigenvalue is so many times the next
  SectionPath section = SectionPath::plane;
  bool winding = true;  ///< false: no sections, both angles stay NaN
};

/// Balls of all vertices at each radius (thesis 3.3-3.5). Precondition: edges are manifold and oriented
/// alike, each vertex in one fan; the curvature of an open mesh's boundary vertices means nothing. Grows 128
/// balls at once (lane_balls.h); exactly the balls of plain_ball_fields, sums to 1e-9 of the sum of their
/// absolute values. Same bytes for any thread count and instruction set.
BallSet ball_fields(const geometry::TriangleMesh& mesh, const std::vector<double>& radii_m, Metric metric,
                    const BallOptions& options = {});

/// One ball whole, for placement and pictures.
struct Ball {
  std::vector<int> vertices;   ///< by distance
  std::vector<int> triangles;  ///< ascending
  int boundary_loops = 0;      ///< closed walks along the border with the ball on the left
  bool has_axis = false;
  Vec3 center = Vec3::Zero(), axis = Vec3::Zero();
  Section section;
  double winding_angle_rad = 0, accumulated_angle_rad = 0;
};
/// The plain way, O(V + ball). Precondition as above.
Ball section_of_ball(const geometry::TriangleMesh& mesh, int vertex, double radius_m, Metric metric,
                     const BallOptions& options = {});

/// The fields as named columns: those of `geocage score` in the order of its contract, then what placement
/// needs; and back.
std::vector<geometry::VertexField> columns_of(const BallFields& ball);
BallFields ball_of(const std::vector<geometry::VertexField>& columns, double radius_m);

std::string_view artefact_kind(
    const BallSet*);  ///< "balls": balls.json (radii), ball_<i>.bin (columns of doubles)
void save_artefact(const BallSet& set, const std::filesystem::path& dir);
void load_artefact(BallSet& set, const std::filesystem::path& dir);

}  // namespace geocage::topology
