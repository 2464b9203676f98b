#include "stages/cloud/smooth.h"

#include <pcl/search/kdtree.h>
#include <pcl/surface/mls.h>

#include "geometry/pcl_points.h"

namespace geocage::stages {

geometry::PointCloud smoothed(const geometry::PointCloud& cloud, double radius_m) {
  const geometry::Vec3 origin = cloud.points.front();
  pcl::MovingLeastSquares<pcl::PointXYZ, pcl::PointXYZ> squares;
  squares.setInputCloud(geometry::pcl_points(cloud.points, origin));
  squares.setSearchMethod(pcl::search::KdTree<pcl::PointXYZ>::Ptr(new pcl::search::KdTree<pcl::PointXYZ>));
  squares.setSearchRadius(radius_m);
  squares.setPolynomialOrder(2);
  squares.setComputeNormals(false);
  squares.setNumberOfThreads(1);
  pcl::PointCloud<pcl::PointXYZ> moved;
  squares.process(moved);
  const auto& kept = squares.getCorrespondingIndices()->indices;
  geometry::PointCloud smooth = geometry::subset(cloud, {kept.begin(), kept.end()});
  for (std::size_t i = 0; i < moved.size(); ++i)
    smooth.points[i] = origin + moved[i].getVector3fMap().cast<double>();
  return smooth;
}

}  // namespace geocage::stages
