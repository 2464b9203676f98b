#pragma once
#include <filesystem>
#include <string_view>
#include <vector>

#include "geometry/mesh.h"

namespace geocage::topology {

using geometry::Vec3;

/// hop: number of edges x mean edge length (thesis 3.3); dijkstra: lengths of edges.
enum class Metric { hop, dijkstra };

/// All that the ball of radius r around each vertex says, one entry a vertex.
struct BallFields {
  double radius_m = 0;
  std::vector<double> curvature_sum_rad;  ///< S2: sum of angle defects over the ball's vertices
  std::vector<double> winding_angle_rad;  ///< S1: in [pi, 2 pi]; NaN where there is no dominant axis
  std::vector<int> ball_vertices, ball_triangles, euler;
  std::vector<double> ball_area_m2;
  std::vector<Vec3> center, axis;  ///< Z, and the unit principal axis A (zero where there is none)
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

/// Balls of all vertices at each radius (thesis 3.3-3.5). Precondition: edges are manifold; the curvature of
/// an open mesh's boundary vertices means nothing. The plain implementation, kept as oracle: one search a
/// vertex, O(V x ball). Same bytes for any thread count. `eigenvalue_ratio_guard`: the axis counts as
/// dominant when the two largest eigenvalues of the ball's covariance differ by this factor.
BallSet ball_fields(const geometry::TriangleMesh& mesh, const std::vector<double>& radii_m, Metric metric,
                    double eigenvalue_ratio_guard = 1.1);

/// The fields as named columns: those of `geocage score` in the order of its contract, then what placement
/// needs; and back.
std::vector<geometry::VertexField> columns_of(const BallFields& ball);
BallFields ball_of(const std::vector<geometry::VertexField>& columns, double radius_m);

std::string_view artefact_kind(
    const BallSet*);  ///< "balls": balls.json (radii), ball_<i>.bin (columns of doubles)
void save_artefact(const BallSet& set, const std::filesystem::path& dir);
void load_artefact(BallSet& set, const std::filesystem::path& dir);

}  // namespace geocage::topology
