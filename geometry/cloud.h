#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string_view>
#include <vector>

#include "geometry/pose.h"

namespace geocage::geometry {

/// Points on an object's surface as sensors saw them; metres, object frame O.
struct PointCloud {
  std::vector<Vec3> points;
  std::vector<Vec3> normals;  ///< empty, or one unit normal a point, outward
  std::vector<int> view;      ///< empty, or the index into `sensor_origins` of the view that saw the point
  std::vector<Vec3> sensor_origins;  ///< p_OS of each view; empty where unknown
  std::vector<int> label;            ///< empty, or what the file calls the thing that each point lies on
  std::optional<Plane> support;      ///< the table it stands on, normal up; the object is above

  std::size_t size() const { return points.size(); }
};

/// The points of these indices with all that is known of them; sensors and support stay.
PointCloud subset(const PointCloud& cloud, const std::vector<int>& chosen);
/// Diagonal of the bounding box; 0 of no points.
double diagonal_m(const std::vector<Vec3>& points);

std::string_view artefact_kind(
    const PointCloud*);  ///< "cloud": cloud.ply (points), cloud.json (sensors, support)
void save_artefact(const PointCloud& cloud, const std::filesystem::path& dir);
void load_artefact(PointCloud& cloud, const std::filesystem::path& dir);

}  // namespace geocage::geometry
