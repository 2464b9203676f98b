#include <pcl/console/print.h>
#include <pcl/conversions.h>
#include <pcl/surface/poisson.h>

#include "stages/reconstruct/surfaces.h"

namespace geocage::stages {

geometry::TriangleMesh poisson_surface(const geometry::PointCloud& cloud, int depth,
                                       double samples_per_node) {
  pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS);
  pcl::PointCloud<pcl::PointNormal>::Ptr points(new pcl::PointCloud<pcl::PointNormal>);
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    pcl::PointNormal point;
    point.getVector3fMap() = cloud.points[i].cast<float>();
    point.getNormalVector3fMap() = cloud.normals[i].cast<float>();
    points->push_back(point);
  }
  pcl::Poisson<pcl::PointNormal> poisson;
  poisson.setDepth(depth);
  poisson.setSamplesPerNode(static_cast<float>(samples_per_node));
  poisson.setThreads(1);  // two cost more CPU and gain nothing
  poisson.setInputCloud(points);
  pcl::PointCloud<pcl::PointNormal> vertices;
  std::vector<pcl::Vertices> polygons;
  poisson.reconstruct(vertices, polygons);

  geometry::TriangleMesh mesh;
  for (const auto& p : vertices) mesh.vertices.emplace_back(p.x, p.y, p.z);
  for (const auto& polygon : polygons)
    mesh.triangles.push_back({static_cast<int>(polygon.vertices[0]), static_cast<int>(polygon.vertices[1]),
                              static_cast<int>(polygon.vertices[2])});
  return mesh;
}

}  // namespace geocage::stages
