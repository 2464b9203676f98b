#pragma once
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include "geometry/mesh.h"

namespace geocage::tests {

/// Where a sensor looks from at the middle of the table, and its noise.
struct View {
  double elevation_deg, distance_m = 0.85;
  std::uint64_t seed = 1;
};

/// Things on a table, each a closed mesh in place: the table's top is z = 0, sensors look along +x.
struct TableScene {
  std::string name;
  std::vector<geometry::TriangleMesh> things;
  std::vector<View> views = {{35}, {50}};
  geometry::Vec3 table_m = {0.8, 0.7, 0.02};      ///< its top, about the z axis
  std::vector<geometry::TriangleMesh> room = {};  ///< what else is seen, and is no thing on the table
};

/// Which seeds of a set of chance, counted from its first.
struct Seeds {
  int from = 0, to = std::numeric_limits<int>::max();  ///< to: the first that isn't
};

/// A set of scenes by name. "tuning" and "fresh": the numbers of import.cluster_by = shape were chosen on
/// them. "held_out": other shapes, sizes and arrangements, by hand. "fresh", "unseen": one to four things of
/// chance, pushed together or put on each other, by other seeds; nothing was chosen or mended by "unseen".
/// "wide": one to five, of more kinds. "varied": one to six, of still more kinds, seen from one place of
/// chance (28 to 62 degrees, 0.7 to 1 m) each; "varied_2", "varied_3": of that kind, each for a look when
/// all is chosen. "rooms": things of "varied_3" on tables of several sizes in rooms of chance: floor, walls,
/// chairs, boxes beside the table; "rooms_trial": others, to choose by. "far_rooms",
/// "far_rooms_trial": rooms with tables as low as 0.35 m, other tables and shelves, from 22 to 60 degrees and
/// 0.9 to 1.3 m. "trial": of that kind, to choose by. "training", "training_varied": other scenes of these
/// two kinds; "training_low": three to six things of that kind from 28 to 42 degrees. Meshes of `objects`,
/// where it isn't empty, stand among them. Sets by hand, "fresh" and "unseen" come whole. Precondition: one
/// of these names.
std::vector<TableScene> table_scenes(const std::string& set, const std::filesystem::path& objects,
                                     Seeds seeds = {});

/// The scene before the virtual Kinect as a PCD with the sensor's place and, as labels, the thing that each
/// point lies nearest to (from 1; 0: table).
void write_seen(const TableScene& scene, const View& view, const std::filesystem::path& file);

}  // namespace geocage::tests
