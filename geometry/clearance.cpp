#include "geometry/clearance.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include <octomap/octomap.h>

#include "geometry/median.h"
#include "pipeline/error.h"

namespace geocage::geometry {

namespace {

using pipeline::Fault;
using pipeline::UserError;

constexpr double infinity = std::numeric_limits<double>::infinity();

/// d(i) = min over j of (i - j)^2 + f(j): the lower envelope of parabolas, in one pass to and one fro.
class LineTransform {
 public:
  explicit LineTransform(int longest) : f_(longest), foot_(longest), from_(longest + 1) {}

  /// Of `count` values, `stride` apart.
  void operator()(double* values, int count, std::ptrdiff_t stride) {
    for (int i = 0; i < count; ++i) f_[i] = values[i * stride];
    int last = -1;
    for (int j = 0; j < count; ++j) {
      if (f_[j] == infinity) continue;
      double cross = -infinity;
      while (last >= 0 && (cross = crossing(foot_[last], j)) <= from_[last]) --last;
      foot_[++last] = j;
      from_[last] = last == 0 ? -infinity : cross;
    }
    if (last < 0) return;
    from_[last + 1] = infinity;
    for (int i = 0, k = 0; i < count; ++i) {
      while (from_[k + 1] < i) ++k;
      const double along = i - foot_[k];
      values[i * stride] = along * along + f_[foot_[k]];
    }
  }

 private:
  /// Where the parabola at j comes to lie below the one at i < j.
  double crossing(int i, int j) const {
    return ((f_[j] + double(j) * j) - (f_[i] + double(i) * i)) / (2.0 * (j - i));
  }
  std::vector<double> f_;
  std::vector<int> foot_;
  std::vector<double> from_;
};

/// The cells around what is occupied, and what is known of each.
struct Cells {
  Vec3 first;  ///< centre of cell (0, 0, 0)
  std::array<int, 3> size = {0, 0, 0};
  std::vector<Space> space;  ///< x fastest
  std::size_t index(const std::array<int, 3>& at) const {
    return at[0] + std::size_t(size[0]) * (at[1] + std::size_t(size[1]) * at[2]);
  }
};

Vec3 to_vec(const octomap::point3d& p) {
  return {p.x(), p.y(), p.z()};
}

Cells cells_of(const octomap::OcTree& tree, double pad_m) {
  const double h = tree.getResolution();
  Vec3 low = Vec3::Constant(infinity), high = -low;
  for (auto leaf = tree.begin_leafs(); leaf != tree.end_leafs(); ++leaf)
    if (tree.isNodeOccupied(*leaf)) {
      const Vec3 center = to_vec(leaf.getCoordinate()), half = Vec3::Constant(leaf.getSize() / 2);
      low = low.cwiseMin(center - half);
      high = high.cwiseMax(center + half);
    }
  if (low.x() > high.x()) throw UserError(Fault::geometry, "clearance", "no cell of the map is occupied");
  Cells cells;
  double count = 1;
  for (int k = 0; k < 3; ++k) {
    const double first = std::floor((low[k] - pad_m) / h + 1e-3),
                 end = std::ceil((high[k] + pad_m) / h - 1e-3);
    cells.first[k] = (first + 0.5) * h;
    cells.size[k] = std::max(2, static_cast<int>(end - first));
    count *= cells.size[k];
  }
  if (count > double(1 << 26))
    throw UserError(Fault::geometry, "clearance", "the grid would have more than 67 million cells",
                    "make occupancy.resolution_m larger or clearance.pad_m smaller");
  cells.space.assign(static_cast<std::size_t>(count), Space::unknown);
  return cells;
}

/// A leaf may be many cells large.
void fill(Cells& cells, const octomap::OcTree& tree) {
  const double h = tree.getResolution();
  for (auto leaf = tree.begin_leafs(); leaf != tree.end_leafs(); ++leaf) {
    std::array<int, 3> low, high;
    for (int k = 0; k < 3; ++k) {
      const double corner = leaf.getCoordinate()(k) - leaf.getSize() / 2;
      const long at = std::lround((corner - (cells.first[k] - h / 2)) / h);
      low[k] = static_cast<int>(std::clamp<long>(at, 0, cells.size[k]));
      high[k] = static_cast<int>(std::clamp<long>(at + std::lround(leaf.getSize() / h), 0, cells.size[k]));
    }
    const Space space = tree.isNodeOccupied(*leaf) ? Space::occupied : Space::free;
    for (int z = low[2]; z < high[2]; ++z)
      for (int y = low[1]; y < high[1]; ++y)
        for (int x = low[0]; x < high[0]; ++x) cells.space[cells.index({x, y, z})] = space;
  }
}

}  // namespace

std::vector<double> squared_distances(const std::array<int, 3>& size, const std::vector<bool>& chosen) {
  std::vector<double> distance(chosen.size());
  for (std::size_t i = 0; i < chosen.size(); ++i) distance[i] = chosen[i] ? 0 : infinity;
  LineTransform transform(std::max({size[0], size[1], size[2]}));
  const std::ptrdiff_t dy = size[0], dz = dy * size[1];
  for (int z = 0; z < size[2]; ++z)
    for (int y = 0; y < size[1]; ++y) transform(&distance[z * dz + y * dy], size[0], 1);
  for (int z = 0; z < size[2]; ++z)
    for (int x = 0; x < size[0]; ++x) transform(&distance[z * dz + x], size[1], dy);
  for (int y = 0; y < size[1]; ++y)
    for (int x = 0; x < size[0]; ++x) transform(&distance[y * dy + x], size[2], dz);
  return distance;
}

namespace {

SignedDistanceField field_of(const Cells& cells, const std::vector<bool>& solid, double cell_m) {
  std::vector<bool> open = solid;
  open.flip();
  const auto to_solid = squared_distances(cells.size, solid), to_open = squared_distances(cells.size, open);
  SignedDistanceField field;
  field.origin = cells.first;
  field.cell_m = cell_m;
  field.nodes = cells.size;
  const double most =
      std::hypot(cells.size[0], cells.size[1], cells.size[2]);  // where no cell is of one kind
  for (std::size_t i = 0; i < solid.size(); ++i) {
    const double distance = std::min(most, std::sqrt(solid[i] ? to_open[i] : to_solid[i])) - 0.5;
    field.coarse.push_back(static_cast<float>((solid[i] ? -distance : distance) * cell_m));
  }
  field.block.assign(std::size_t(cells.size[0] - 1) * (cells.size[1] - 1) * (cells.size[2] - 1), 0);
  field.mark();
  return field;
}

/// Of each cell, how many its group has; cells of a group touch, be it at a corner.
std::vector<int> group_sizes(const std::vector<Vec3>& centers, double side_m) {
  std::map<std::array<long, 3>, std::size_t> at;
  const auto place = [&](const Vec3& p) {
    return std::array<long, 3>{std::lround(p.x() / side_m - 0.5), std::lround(p.y() / side_m - 0.5),
                               std::lround(p.z() / side_m - 0.5)};
  };
  for (std::size_t i = 0; i < centers.size(); ++i) at[place(centers[i])] = i;
  std::vector<int> size(centers.size(), 0);
  for (std::size_t first = 0; first < centers.size(); ++first) {
    if (size[first] != 0) continue;
    std::vector<std::size_t> group = {first};
    size[first] = -1;
    for (std::size_t k = 0; k < group.size(); ++k) {
      const auto here = place(centers[group[k]]);
      for (long x = -1; x <= 1; ++x)
        for (long y = -1; y <= 1; ++y)
          for (long z = -1; z <= 1; ++z) {
            const auto found = at.find({here[0] + x, here[1] + y, here[2] + z});
            if (found == at.end() || size[found->second] != 0) continue;
            size[found->second] = -1;
            group.push_back(found->second);
          }
    }
    for (std::size_t i : group) size[i] = static_cast<int>(group.size());
  }
  return size;
}

}  // namespace

SignedDistanceField clearance_field(const Occupancy& map, const ClearanceRule& rule) {
  Cells cells = cells_of(*map.tree, rule.pad_m);
  fill(cells, *map.tree);
  std::vector<bool> solid;
  for (const Space space : cells.space)
    solid.push_back(space == Space::occupied || (space == Space::unknown && rule.unknown_is_solid));
  return field_of(cells, solid, map.tree->getResolution());
}

Others other_cells(const Occupancy& map, const SignedDistanceField& object, const PointCloud& cloud,
                   const OwnRule& rule) {
  Others others;
  const OccupiedCells cells = occupied_cells(map);
  std::vector<double> off;
  for (const Vec3& p : cloud.points) {
    if (cloud.support && cloud.support->height_m(p) < rule.near_cells * cells.side_m) continue;
    const double distance = std::abs(object.value(p));
    if (distance < rule.noise_reach_m) off.push_back(distance);
  }
  others.deviation_m = deviation_of_sizes(std::move(off));
  others.band_m = rule.near_cells * cells.side_m + rule.noise_deviations * others.deviation_m;
  std::vector<Vec3> left;
  for (const Vec3& p : cells.centers_O) {
    if (object.value(p) < others.band_m)
      ++others.of_object;
    else if (cloud.support && cloud.support->height_m(p) < others.band_m)
      ++others.of_support;
    else
      left.push_back(p);
  }
  const auto sizes = group_sizes(left, cells.side_m);
  for (std::size_t i = 0; i < left.size(); ++i) {
    if (sizes[i] < rule.least_cells)
      ++others.stray;
    else
      others.centers_O.push_back(left[i]);
  }
  return others;
}

SignedDistanceField clearance_of_others(const Occupancy& map, const Others& others,
                                        const SignedDistanceField& object, const PointCloud& cloud,
                                        const ClearanceRule& rule) {
  if (!map.tree || (others.centers_O.empty() && !rule.unknown_is_solid)) return {};
  PointCloud points;
  points.points = others.centers_O;
  if (!rule.unknown_is_solid)
    return clearance_field(map_of_rays(points, map.tree->getResolution()), {false, rule.pad_m});
  Cells cells = cells_of(*map.tree, rule.pad_m);
  fill(cells, *map.tree);
  std::vector<bool> solid;
  bool any = false;
  std::size_t i = 0;
  for (int z = 0; z < cells.size[2]; ++z)
    for (int y = 0; y < cells.size[1]; ++y)
      for (int x = 0; x < cells.size[0]; ++x, ++i) {
        const Vec3 p = cells.first + map.tree->getResolution() * Vec3(x, y, z);
        solid.push_back(cells.space[i] == Space::unknown && object.value(p) >= others.band_m &&
                        !(cloud.support && cloud.support->height_m(p) < others.band_m));
        any |= solid.back();
      }
  for (const Vec3& p : others.centers_O) {
    std::array<int, 3> at;
    for (int k = 0; k < 3; ++k)
      at[static_cast<std::size_t>(k)] =
          static_cast<int>(std::lround((p[k] - cells.first[k]) / map.tree->getResolution()));
    solid[cells.index(at)] = any = true;
  }
  if (!any) return {};
  return field_of(cells, solid, map.tree->getResolution());
}

}  // namespace geocage::geometry
