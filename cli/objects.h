#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "geometry/pose.h"
#include "pipeline/settings.h"

namespace geocage::cli {

/// An object of a flow: a file that is there, or the reason why there is none.
struct FlowObject {
  std::string name;
  std::filesystem::path path;
  std::string source;                             ///< where it comes from: package and licence, or "file"
  geometry::Vec3 up_O = geometry::Vec3::UnitZ();  ///< for pictures
  bool cloud = false;                             ///< otherwise a mesh, which is the truth
  std::string part;                               ///< of a scene: this object alone; empty: all of them
  std::vector<pipeline::Setting> settings;        ///< what the catalogue knows: unit, scene, cluster
  std::string skipped, failed;                    ///< a sentence when it can't be had, or can't be read
};

/// Objects named by catalogue names, files and globs, in that order, each once. Catalogue objects are fetched
/// when they are missing. UserError (configuration) for a word that is none of these.
std::vector<FlowObject> find_objects(const std::vector<std::string>& words, const std::string& where);

/// Every mesh and cloud file of a folder, sorted by name; UserError (configuration) when there is no such
/// folder or it holds none.
std::vector<FlowObject> objects_of_folder(const std::filesystem::path& folder);

}  // namespace geocage::cli
