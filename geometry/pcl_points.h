#pragma once
#include <span>

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include "geometry/pose.h"

namespace geocage::geometry {

/// The same point in PCL's single precision.
inline pcl::PointXYZ pcl_point(const Vec3& p) {
  return {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())};
}

/// All points in their order, as seen from `origin`: near the points it saves what single precision would
/// round away.
inline pcl::PointCloud<pcl::PointXYZ>::Ptr pcl_points(std::span<const Vec3> points,
                                                      const Vec3& origin = Vec3::Zero()) {
  pcl::PointCloud<pcl::PointXYZ>::Ptr cloud(new pcl::PointCloud<pcl::PointXYZ>);
  cloud->reserve(points.size());
  for (const Vec3& p : points) cloud->push_back(pcl_point(p - origin));
  return cloud;
}

}  // namespace geocage::geometry
