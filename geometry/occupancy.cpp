#include "geometry/occupancy.h"

#include <cerrno>
#include <cmath>
#include <fstream>
#include <string>
#include <system_error>
#include <unordered_map>

#include <octomap/octomap.h>
#include <omp.h>

namespace geocage::geometry {

namespace {

octomap::point3d octo(const Vec3& p) {
  return {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())};
}

/// OctoMap's insertion sets the number of OpenMP threads of whoever calls it, and leaves it so.
class KeptThreadCount {
 public:
  ~KeptThreadCount() { omp_set_num_threads(count_); }

 private:
  const int count_ = omp_get_max_threads();
};

/// One view. A ray of each cell where rays end stands for them all: where fewer than the share of the rays
/// that come into a cell end there, they are a sensor's noise and the cell is passed.
void insert(octomap::OcTree& tree, const octomap::Pointcloud& ends, const octomap::point3d& origin,
            double least_end_share) {
  if (least_end_share == 0) {
    tree.insertPointCloud(ends, origin, -1, true, true);
    return;
  }
  struct Rays {
    std::size_t ending = 0, passing = 0;
  };
  std::unordered_map<octomap::OcTreeKey, Rays, octomap::OcTreeKey::KeyHash> cells;
  for (const octomap::point3d& end : ends) ++cells[tree.coordToKey(end)].ending;
  octomap::KeySet passed;
  octomap::KeyRay ray;
  for (const auto& [end, rays] : cells) {
    if (!tree.computeRayKeys(origin, tree.keyToCoord(end), ray)) continue;
    for (const octomap::OcTreeKey& key : ray) {
      if (const auto cell = cells.find(key); cell != cells.end())
        cell->second.passing += rays.ending;
      else
        passed.insert(key);
    }
  }
  for (const octomap::OcTreeKey& key : passed) tree.updateNode(key, false, true);
  for (const auto& [key, rays] : cells)
    tree.updateNode(
        key,
        static_cast<double>(rays.ending) >= least_end_share * static_cast<double>(rays.ending + rays.passing),
        true);
}

}  // namespace

Occupancy map_of_rays(const PointCloud& cloud, double resolution_m, double least_end_share) {
  const KeptThreadCount kept;
  Occupancy map{std::make_shared<octomap::OcTree>(resolution_m)};
  if (cloud.sensor_origins.empty() || cloud.view.empty()) {
    for (const Vec3& p : cloud.points) map.tree->updateNode(octo(p), true, true);
  } else {
    std::vector<octomap::Pointcloud> scans(cloud.sensor_origins.size());
    for (std::size_t i = 0; i < cloud.size(); ++i) scans[cloud.view[i]].push_back(octo(cloud.points[i]));
    for (std::size_t v = 0; v < scans.size(); ++v)
      insert(*map.tree, scans[v], octo(cloud.sensor_origins[v]), least_end_share);
  }
  map.tree->updateInnerOccupancy();
  map.tree->toMaxLikelihood();  // what a .bt file keeps
  map.tree->prune();
  return map;
}

Space space_at(const Occupancy& map, const Vec3& p_O) {
  const auto* node = map.tree->search(octo(p_O));
  if (!node) return Space::unknown;
  return map.tree->isNodeOccupied(node) ? Space::occupied : Space::free;
}

SpaceCounts count_cells(const Occupancy& map) {
  SpaceCounts counts;
  for (auto leaf = map.tree->begin_leafs(); leaf != map.tree->end_leafs(); ++leaf) {
    const std::size_t cells = std::size_t{1} << (3 * (map.tree->getTreeDepth() - leaf.getDepth()));
    (map.tree->isNodeOccupied(*leaf) ? counts.occupied : counts.free) += cells;
  }
  return counts;
}

OccupiedCells occupied_cells(const Occupancy& map) {
  OccupiedCells cells;
  if (!map.tree) return cells;
  cells.side_m = map.tree->getResolution();
  for (auto leaf = map.tree->begin_leafs(), end = map.tree->end_leafs(); leaf != end; ++leaf) {
    if (!map.tree->isNodeOccupied(*leaf)) continue;
    const int n = static_cast<int>(std::lround(leaf.getSize() / cells.side_m));  // pruned cells are larger
    const Vec3 low(leaf.getX(), leaf.getY(), leaf.getZ());
    for (int z = 0; z < n; ++z)
      for (int y = 0; y < n; ++y)
        for (int x = 0; x < n; ++x)
          cells.centers_O.push_back(low + cells.side_m * (Vec3(x, y, z) - Vec3::Constant((n - 1) / 2.0)));
  }
  return cells;
}

std::string_view artefact_kind(const Occupancy*) {
  return "occupancy";
}

void save_artefact(const Occupancy& map, const std::filesystem::path& dir) {
  const auto file = dir / "occupancy.bt";
  std::ofstream out(file, std::ios::binary);
  // As OcTree::writeBinary does, which also talks to stderr.
  out << "# Octomap OcTree binary file\nid " << map.tree->getTreeType() << "\nsize " << map.tree->size()
      << "\nres " << map.tree->getResolution() << "\ndata\n";
  map.tree->writeBinaryData(out);
  if (!out.flush()) throw std::system_error(errno, std::generic_category(), file.string());
}

void load_artefact(Occupancy& map, const std::filesystem::path& dir) {
  const auto file = dir / "occupancy.bt";
  std::ifstream in(file, std::ios::binary);
  // Past the header by hand: OctoMap's own reader of it talks to the terminal.
  double resolution_m = 0;
  std::string line;
  while (std::getline(in, line) && line != "data")
    if (line.starts_with("res ")) resolution_m = std::stod(line.substr(4));
  if (!in || !(resolution_m > 0)) throw std::system_error(EIO, std::generic_category(), file.string());
  map.tree = std::make_shared<octomap::OcTree>(resolution_m);
  if (!map.tree->readBinaryData(in)) throw std::system_error(EIO, std::generic_category(), file.string());
}

}  // namespace geocage::geometry
