#include "stages/cloud/smooth.h"

#include <pcl/search/kdtree.h>
#include <pcl/surface/mls.h>

namespace geocage::stages {

geometry::PointCloud smoothed(const geometry::PointCloud& cloud, double radius_m) {
  using Points = pcl::PointCloud<pcl::PointXYZ>;
  const geometry::Vec3 middle = cloud.points.front();  // PCL's numbers are in single precision
  Points::Ptr points(new Points);
  for (const auto& p : cloud.points) {
    const Eigen::Vector3f q = (p - middle).cast<float>();
    points->emplace_back(q.x(), q.y(), q.z());
  }
  pcl::MovingLeastSquares<pcl::PointXYZ, pcl::PointXYZ> squares;
  squares.setInputCloud(points);
  squares.setSearchMethod(pcl::search::KdTree<pcl::PointXYZ>::Ptr(new pcl::search::KdTree<pcl::PointXYZ>));
  squares.setSearchRadius(radius_m);
  squares.setPolynomialOrder(2);
  squares.setComputeNormals(false);
  squares.setNumberOfThreads(1);
  Points moved;
  squares.process(moved);
  const auto& kept = squares.getCorrespondingIndices()->indices;
  geometry::PointCloud smooth = geometry::subset(cloud, {kept.begin(), kept.end()});
  for (std::size_t i = 0; i < moved.size(); ++i)
    smooth.points[i] = middle + moved[i].getVector3fMap().cast<double>();
  return smooth;
}

}  // namespace geocage::stages
