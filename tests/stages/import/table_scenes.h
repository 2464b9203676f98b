#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "geometry/mesh.h"

namespace geocage::tests {

/// Things on a table, each a closed mesh in place: the table's top is z = 0, the sensor looks along +x.
struct TableScene {
  std::string name;
  std::vector<geometry::TriangleMesh> things;
};

/// A set of scenes by name. "tuning": the numbers of import.cluster_by = shape were chosen on them, and on
/// "practice". "held_out": other shapes, sizes and arrangements, by hand. "fresh", "practice", "unseen": one
/// to four things of chance, pushed together or put on each other, each by other seeds; nothing was chosen or
/// mended by "unseen". Meshes of `objects`, where it isn't empty, stand among them. Precondition: one of
/// these names.
std::vector<TableScene> table_scenes(const std::string& set, const std::filesystem::path& objects);

/// The scene before the virtual Kinect, 0.85 m from the middle of the table and `elevation_deg` above it, as
/// a PCD with the sensor's place and, as labels, the thing that each point lies nearest to (from 1; 0:
/// table).
void write_seen(const TableScene& scene, double elevation_deg, std::uint64_t seed,
                const std::filesystem::path& file);

}  // namespace geocage::tests
