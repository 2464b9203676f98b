#pragma once
#include <filesystem>
#include <memory>
#include <string_view>
#include <vector>

#include "geometry/cloud.h"

namespace octomap {
class OcTree;
}

namespace geocage::geometry {

enum class Space { free, occupied, unknown };

/// What rays have seen of space, as an OctoMap.
struct Occupancy {
  std::shared_ptr<octomap::OcTree> tree;
};

/// Cells that a ray from its sensor passed are free, cells where one ended are occupied, all others unknown.
/// Within one view an end wins over a pass. Points without a known sensor mark their cells occupied and free
/// nothing. With a `least_end_share` an end wins only where so many of the view's rays that come into a cell
/// end there: a sensor's noise leaves few before a surface, which all others pass; 0 asks nothing.
Occupancy map_of_rays(const PointCloud& cloud, double resolution_m, double least_end_share = 0);

Space space_at(const Occupancy& map, const Vec3& p_O);

struct SpaceCounts {
  std::size_t free = 0, occupied = 0;
};
SpaceCounts count_cells(const Occupancy& map);

/// The finest cells that are known to be occupied; none of a map without a tree.
struct OccupiedCells {
  std::vector<Vec3> centers_O;
  double side_m = 0;
};
OccupiedCells occupied_cells(const Occupancy& map);

std::string_view artefact_kind(const Occupancy*);  ///< "occupancy": occupancy.bt (octovis opens it)
void save_artefact(const Occupancy& map, const std::filesystem::path& dir);
void load_artefact(Occupancy& map, const std::filesystem::path& dir);

}  // namespace geocage::geometry
