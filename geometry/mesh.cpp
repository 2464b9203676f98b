#include "geometry/mesh.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace geocage::geometry {

namespace {

/// Rows from (row, item) pairs, items ascending and each once.
CompressedRows rows_of(std::vector<std::pair<int, int>> pairs, std::size_t rows) {
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  CompressedRows out;
  out.start.assign(rows + 1, 0);
  for (const auto& [row, item] : pairs) {
    ++out.start[static_cast<std::size_t>(row) + 1];
    out.items.push_back(item);
  }
  std::partial_sum(out.start.begin(), out.start.end(), out.start.begin());
  return out;
}

Vec3 double_area_normal(const TriangleMesh& mesh, const std::array<int, 3>& t) {
  const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
  return (b - a).cross(c - a);
}

}  // namespace

CompressedRows vertex_neighbours(const TriangleMesh& mesh) {
  std::vector<std::pair<int, int>> pairs;
  pairs.reserve(mesh.triangles.size() * 6);
  for (const auto& t : mesh.triangles)
    for (int i = 0; i < 3; ++i) {
      pairs.emplace_back(t[i], t[(i + 1) % 3]);
      pairs.emplace_back(t[(i + 1) % 3], t[i]);
    }
  return rows_of(std::move(pairs), mesh.vertices.size());
}

CompressedRows vertex_triangles(const TriangleMesh& mesh) {
  std::vector<std::pair<int, int>> pairs;
  pairs.reserve(mesh.triangles.size() * 3);
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f)
    for (int v : mesh.triangles[f]) pairs.emplace_back(v, static_cast<int>(f));
  return rows_of(std::move(pairs), mesh.vertices.size());
}

double mean_edge_m(const TriangleMesh& mesh) {
  const CompressedRows neighbours = vertex_neighbours(mesh);
  double sum = 0;
  for (int v = 0; v + 1 < static_cast<int>(neighbours.start.size()); ++v)
    for (int i = neighbours.start[v]; i < neighbours.start[v + 1]; ++i)
      sum += (mesh.vertices[v] - mesh.vertices[neighbours.items[i]]).norm();
  return neighbours.items.empty() ? 0 : sum / static_cast<double>(neighbours.items.size());
}

std::vector<Vec3> vertex_normals(const TriangleMesh& mesh) {
  std::vector<Vec3> normals(mesh.vertices.size(), Vec3::Zero());
  for (const auto& t : mesh.triangles) {
    const Vec3 n = double_area_normal(mesh, t);
    for (int v : t) normals[v] += n;
  }
  for (Vec3& n : normals) n.normalize();
  return normals;
}

std::vector<double> vertex_areas_m2(const TriangleMesh& mesh) {
  std::vector<double> areas(mesh.vertices.size(), 0);
  for (const auto& t : mesh.triangles) {
    const double third = double_area_normal(mesh, t).norm() / 6;
    for (int v : t) areas[v] += third;
  }
  return areas;
}

bool orient_outward(TriangleMesh& mesh) {
  double volume = 0;
  for (const auto& t : mesh.triangles)
    volume += mesh.vertices[t[0]].dot(mesh.vertices[t[1]].cross(mesh.vertices[t[2]]));
  if (volume >= 0) return false;
  for (auto& t : mesh.triangles) std::swap(t[1], t[2]);
  return true;
}

MassProperties mass_properties(const TriangleMesh& mesh) {
  // Tetrahedra from a reference point on the object, so that a far origin costs no digits.
  const Vec3 reference = mesh.vertices.empty() ? Vec3::Zero() : mesh.vertices.front();
  double volume = 0;
  Vec3 first = Vec3::Zero();
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();  // integral of x x'
  for (const auto& t : mesh.triangles) {
    Eigen::Matrix3d corners;
    for (int i = 0; i < 3; ++i) corners.col(i) = mesh.vertices[t[i]] - reference;
    const double v = corners.determinant() / 6;
    const Vec3 sum = corners.rowwise().sum();
    volume += v;
    first += v / 4 * sum;
    second += v / 20 * (corners * corners.transpose() + sum * sum.transpose());
  }
  MassProperties mass;
  mass.volume_m3 = volume;
  if (volume == 0) return mass;
  const Vec3 center = first / volume;
  const Eigen::Matrix3d central = second - volume * center * center.transpose();
  mass.center = reference + center;
  mass.inertia = central.trace() * Eigen::Matrix3d::Identity() - central;
  return mass;
}

}  // namespace geocage::geometry
