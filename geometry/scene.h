#pragma once
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "geometry/cloud.h"

namespace geocage::geometry {

/// A cloud and the objects in it.
struct Scene {
  struct Object {
    std::string name;         ///< of the object within the scene; empty where the whole cloud is the object
    std::vector<int> points;  ///< indices into the cloud, ascending
  };
  PointCloud cloud;  ///< its support is the table, where there is one
  std::vector<Object> objects;
};

std::string_view artefact_kind(
    const Scene*);  ///< "scene": cloud.ply, cloud.json, scene.json (names and counts), points.bin (int32)
void save_artefact(const Scene& scene, const std::filesystem::path& dir);
void load_artefact(Scene& scene, const std::filesystem::path& dir);

}  // namespace geocage::geometry
