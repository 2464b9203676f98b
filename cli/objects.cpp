#include "cli/objects.h"

#include <algorithm>
#include <set>

#include <fmt/format.h>
#include <glob.h>

#include "datasets/catalogue.h"
#include "geometry/cloud_files.h"
#include "geometry/file_guards.h"
#include "geometry/mesh_files.h"
#include "pipeline/spelling.h"

namespace geocage::cli {

namespace fs = std::filesystem;
using pipeline::Setting;

namespace {

/// Endings of other things too, which are objects only when somebody names the file.
const std::set<std::string> common_endings = {".txt", ".csv", ".xml", ".raw"};

bool readable_name(const fs::path& file) {
  return geometry::is_mesh_ending(geometry::ending_of(file)) ||
         geometry::is_cloud_ending(geometry::ending_of(file));
}
bool surely_object(const fs::path& file) {
  return readable_name(file) && !common_endings.contains(geometry::ending_of(file));
}

FlowObject object_of_file(const fs::path& file) {
  FlowObject object;
  object.name = pipeline::plain_name(file.stem());
  if (object.name == "." || object.name == "..") object.name = "_" + object.name;  // slots are paths
  object.path = file;
  object.source = "file";
  std::error_code error;
  object.cloud = fs::is_regular_file(file, error) && geometry::is_cloud_file(file);
  return object;
}

FlowObject object_of_entry(const datasets::Entry& entry) {
  FlowObject object;
  object.name = entry.name;
  const std::string file = fs::path(entry.member.empty() ? entry.path : entry.member).filename();
  object.source = !entry.shape.empty() ? "made: " + entry.shape
                  : !entry.url.empty() ? entry.url + ", " + entry.licence
                  : !entry.npm.empty()
                      ? fmt::format("{} of npm's {}, {}", file, entry.npm, entry.licence)
                      : fmt::format("{} of Debian's {}, {}", file, entry.package, entry.licence);
  object.cloud = entry.kind == "cloud";
  object.up_O = geometry::Vec3::Unit(entry.up == "x" ? 0 : entry.up == "y" ? 1 : 2);
  const auto set = [&](const char* field, pipeline::SettingValue value) {
    object.settings.push_back({"catalogue: " + entry.name, "import", field, std::move(value)});
  };
  set("unit", entry.unit);
  set("scene", entry.scene);
  set("cluster", std::int64_t(entry.cluster));
  const auto found = datasets::get(entry, datasets::datasets_folder());
  object.path = found.file;
  const bool there =
      found.presence == datasets::Presence::have || found.presence == datasets::Presence::fetched;
  if (!there) object.skipped = entry.name + ": not available: " + found.reason;
  return object;
}

std::vector<fs::path> glob_files(const std::string& pattern) {
  glob_t found{};
  std::vector<fs::path> files;
  if (glob(pattern.c_str(), 0, nullptr, &found) == 0)
    files.assign(found.gl_pathv, found.gl_pathv + found.gl_pathc);
  globfree(&found);
  return files;
}

/// Files of one stem (mug.stl, mug.obj) get their ending into their names.
void tell_apart(std::vector<FlowObject>& objects) {
  std::multiset<std::string> names;
  for (const auto& object : objects) names.insert(object.name);
  for (auto& object : objects)
    if (names.count(object.name) > 1 && !object.path.extension().empty())
      object.name += "_" + pipeline::plain_name(object.path.extension().string().substr(1));
}

}  // namespace

std::vector<FlowObject> find_objects(const std::vector<std::string>& words, const std::string& where) {
  const auto catalogue = datasets::load_catalogue();
  std::vector<std::string> names, mistakes;
  for (const auto& entry : catalogue) names.push_back(entry.name);
  std::vector<FlowObject> objects;
  std::error_code error;  // a name may be too long for a file
  for (const auto& word : words) {
    const auto entry =
        std::find_if(catalogue.begin(), catalogue.end(), [&](const auto& e) { return e.name == word; });
    const bool set = !word.empty() && std::ranges::count(catalogue, word, &datasets::Entry::set) > 0;
    const bool pattern = word.find_first_of("*?[") != std::string::npos;
    const auto files = pattern ? glob_files(word) : std::vector<fs::path>{};
    if (entry == catalogue.end() && set) {
      for (const auto& one : catalogue)
        if (one.set == word) objects.push_back(object_of_entry(one));
    } else if (entry == catalogue.end() && fs::is_directory(word, error)) {
      for (auto& object : objects_of_folder(word)) objects.push_back(std::move(object));
    } else if (entry != catalogue.end()) {
      objects.push_back(object_of_entry(*entry));
    } else if (pattern && !files.empty()) {
      for (const auto& file : files)
        if (surely_object(file)) objects.push_back(object_of_file(file));
    } else if (fs::exists(word, error) || (!pattern && readable_name(word))) {
      objects.push_back(object_of_file(word));
    } else {
      mistakes.push_back(pipeline::mistake(where, "",
                                           "'" + word + "' is neither an object of the catalogue nor a file" +
                                               pipeline::did_you_mean(word, names)));
    }
  }
  if (words.empty()) mistakes.push_back(pipeline::mistake(where, "", "the flow names no objects"));
  if (!mistakes.empty()) throw pipeline::ConfigurationError(mistakes);
  tell_apart(objects);
  return objects;
}

std::vector<FlowObject> objects_of_folder(const fs::path& folder) {
  std::vector<FlowObject> objects;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error))
    if (surely_object(entry.path())) objects.push_back(object_of_file(entry.path()));
  if (error)
    throw pipeline::UserError(pipeline::Fault::configuration, folder.string(),
                              "this folder can't be read: " + error.message());
  if (objects.empty())
    throw pipeline::UserError(pipeline::Fault::configuration, folder.string(),
                              "this folder holds no mesh and no cloud");
  std::sort(objects.begin(), objects.end(), [](const auto& a, const auto& b) { return a.path < b.path; });
  tell_apart(objects);
  for (auto& object : objects)
    object.settings.push_back({"--dataset", "import", "scene", std::string("object")});
  return objects;
}

}  // namespace geocage::cli
