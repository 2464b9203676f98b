#include "datasets/catalogue.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <fstream>
#include <map>
#include <sstream>
#include <system_error>

#include <nlohmann/json.hpp>
#include <unistd.h>

#include "datasets/program.h"
#include "datasets/shapes.h"
#include "pipeline/digest.h"
#include "pipeline/passing_folder.h"
#include "pipeline/settings.h"

namespace geocage::datasets {

namespace fs = std::filesystem;
using pipeline::mistake;
using pipeline::PassingFolder;

namespace {

/// What an entry can't do without, and what would let a fetch write or read outside its folder.
void check_entry(const Entry& entry, const std::string& where, std::vector<std::string>& mistakes) {
  const auto wrong = [&](const std::string& sentence) {
    mistakes.push_back(mistake(where, entry.name, sentence));
  };
  const auto need = [&](const char* key, const std::string& value) {
    if (value.empty()) wrong(std::string("'") + key + "' is missing");
  };
  need("kind", entry.kind);
  if (!entry.shape.empty()) {
    if (!(entry.package + entry.npm + entry.url + entry.path + entry.sha256).empty())
      wrong("a shape is made, and comes from nowhere else");
    try {
      make_shape(entry.shape, entry.size_m);
    } catch (const pipeline::UserError& error) {
      wrong(error.sentence());
    }
    return;
  }
  const int sources = !entry.package.empty() + !entry.npm.empty() + !entry.url.empty();
  if (sources == 0) wrong("'package' is missing (or 'npm', 'url' or 'shape')");
  if (sources > 1) wrong("say one of 'package', 'npm' and 'url'");
  if (entry.url.empty()) need("path", entry.path);
  need("sha256", entry.sha256);
  need("licence", entry.licence);
  if (!entry.npm.empty()) need("version", entry.version);
  if (!entry.url.empty() && !entry.url.starts_with("https://"))
    wrong("url: '" + entry.url + "' does not begin with https://");
  if (entry.npm.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789-._@/") != std::string::npos ||
      entry.npm.starts_with('-'))
    wrong("npm: '" + entry.npm + "' is not a name of an npm package");
  if (!entry.sha256.empty() &&
      (entry.sha256.size() != 64 || entry.sha256.find_first_not_of("0123456789abcdef") != std::string::npos))
    wrong("sha256: '" + entry.sha256 + "' is not 64 lower-case hexadecimal digits");
  if (entry.package.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789+-.") != std::string::npos ||
      entry.package.starts_with('-'))
    wrong("package: '" + entry.package + "' is not a name of a Debian package");
  const fs::path path = entry.path;
  const fs::path member = entry.member;
  if (member.is_absolute() || entry.member.starts_with('-') ||
      std::count(member.begin(), member.end(), "..") > 0)
    wrong("member: '" + entry.member + "' leaves the archive");
  if (path.is_absolute() || std::count(path.begin(), path.end(), "..") > 0)
    wrong("path: '" + entry.path + "' leaves the package");
}

fs::path place_of(const Entry& entry, const fs::path& folder) {
  const std::string inside = !entry.member.empty() ? entry.member : entry.path;
  std::string name = fs::path(!inside.empty() ? inside : entry.url).filename();
  if (const auto rest = name.find_first_of("?#"); rest != std::string::npos) name.resize(rest);
  if (name.empty()) name = entry.name;
  return folder / entry.sha256 / name;
}

/// Where the entry comes from, in words.
std::string origin(const Entry& entry) {
  if (!entry.npm.empty()) return "npm package " + entry.npm;
  return entry.url.empty() ? "package " + entry.package : entry.url;
}

Availability unavailable(const Entry& entry, const fs::path& place, const std::string& why) {
  return {Presence::unavailable, place, origin(entry) + " can't be had: " + why};
}

/// The one package of a folder; empty when there is none.
fs::path package_in(const fs::path& folder) {
  for (const auto& file : fs::directory_iterator(folder))
    if (const auto ending = file.path().extension(); ending == ".deb" || ending == ".tgz") return file.path();
  return {};
}

std::string unpack_tar(const fs::path& archive, const std::string& member, const fs::path& work,
                       const FetchLimits& limits) {
  return run_program({"tar", "-xf", archive.string(), "-C", work.string(), "--", member}, work,
                     limits.unpack_s)
      .complaint;
}

/// Each brings an entry's file into `work` and answers where; `why` tells what went wrong.
fs::path bring_npm(const Entry& entry, const fs::path& work, const FetchLimits& limits, std::string& why) {
  const auto came = run_program({"npm", "pack", "--ignore-scripts", entry.npm + "@" + entry.version}, work,
                                limits.download_s);
  why = came.complaint;
  if (came.ending != Ending::done) return {};
  const fs::path package = package_in(work);
  if (package.empty()) {
    why = "npm brought no package";
    return {};
  }
  why = unpack_tar(package, entry.path, work, limits);
  return work / entry.path;
}

fs::path bring_url(const Entry& entry, const fs::path& work, const FetchLimits& limits, std::string& why) {
  const auto came = run_program({"curl", "-sSfL", "--proto", "=https", "-o", "download", "--", entry.url},
                                work, limits.download_s);
  why = came.complaint;
  if (came.ending != Ending::done || entry.member.empty()) return work / "download";
  why = unpack_tar(work / "download", entry.member, work, limits);
  return work / entry.member;
}

/// Downloads and unpacks into `work`; what went wrong, or nothing.
std::string unpack_package(const Entry& entry, const fs::path& work, const FetchLimits& limits) {
  std::vector<std::string> download = {"apt-get", "-q", "download", entry.package};
  // Root's apt would change to a user who can't write here, and complain.
  if (geteuid() == 0) download.insert(download.begin() + 1, {"-o", "APT::Sandbox::User=root"});
  const auto came = run_program(download, work, limits.download_s);
  if (came.ending != Ending::done) return came.complaint;
  const fs::path package = package_in(work);
  if (package.empty()) return "apt-get brought no package";
  return run_program({"dpkg-deb", "-x", package.string(), (work / "root").string()}, work, limits.unpack_s)
      .complaint;
}

fs::path bring_package(const Entry& entry, const fs::path& work, const FetchLimits& limits,
                       std::string& why) {
  why = unpack_package(entry, work, limits);
  fs::path file = work / "root" / entry.path;
  if (!why.empty() || entry.member.empty()) return file;
  why = unpack_tar(file, entry.member, work, limits);
  return work / entry.member;
}

/// The list of lists that follows `name =` in a script.
template <class T>
std::vector<std::array<T, 3>> list_after(const std::string& text, const std::string& name) {
  const auto at = text.find(name);
  const auto open = at == std::string::npos ? at : text.find('[', at);
  if (open == std::string::npos) return {};
  int depth = 0;
  auto close = open;
  for (; close < text.size(); ++close) {
    depth += text[close] == '[' ? 1 : text[close] == ']' ? -1 : 0;
    if (depth == 0) break;
  }
  const auto json = nlohmann::json::parse(text.substr(open, close - open + 1), nullptr, false);
  return json.is_discarded() ? std::vector<std::array<T, 3>>{} : json.get<std::vector<std::array<T, 3>>>();
}

void write_beside(const TriangleMesh& mesh, const fs::path& file) {
  fs::create_directories(file.parent_path());
  const PassingFolder work(file.parent_path());
  geometry::write_ply(work.path() / "mesh.ply", mesh);
  fs::rename(work.path() / "mesh.ply", file);
}

/// What was fetched, in a form that readers know.
Availability converted(const Entry& entry, Availability found) {
  const bool there = found.presence == Presence::have || found.presence == Presence::fetched;
  if (entry.convert == "none" || !there) return found;
  const fs::path place = found.file.parent_path() / (entry.name + ".ply");
  if (!fs::exists(place)) {
    std::ostringstream text;
    text << std::ifstream(found.file).rdbuf();
    TriangleMesh mesh;
    for (const auto& p : list_after<double>(text.str(), "positions"))
      mesh.vertices.emplace_back(p[0], p[1], p[2]);
    mesh.triangles = list_after<int>(text.str(), "cells");
    if (mesh.vertices.empty() || mesh.triangles.empty())
      return {Presence::mismatch, found.file, found.file.string() + " holds no positions and cells"};
    write_beside(mesh, place);
  }
  found.file = place;
  return found;
}

/// A shape is made where it isn't, or has other bytes.
Availability made(const Entry& entry, const fs::path& folder, bool write) {
  std::string recipe = entry.shape;
  for (double x : entry.size_m) recipe += " " + std::to_string(x);
  const fs::path place =
      folder / "shapes" / pipeline::sha256_of(recipe).substr(0, 16) / (entry.name + ".ply");
  const TriangleMesh mesh = make_shape(entry.shape, entry.size_m);
  if (fs::exists(place)) {
    const PassingFolder work;  // its own folder may be one to read only
    geometry::write_ply(work.path() / "mesh.ply", mesh);
    if (pipeline::sha256_of_file(work.path() / "mesh.ply") == pipeline::sha256_of_file(place))
      return {Presence::have, place, ""};
    if (!write) return {Presence::mismatch, place, "the file is not this shape"};
  }
  if (!write) return {Presence::unavailable, place, "it has not been made yet"};
  write_beside(mesh, place);
  return {Presence::fetched, place, ""};
}

Availability fetch(const Entry& entry, const fs::path& folder, const FetchLimits& limits) {
  const fs::path place = place_of(entry, folder);
  fs::create_directories(place.parent_path());
  pipeline::sweep_passing_folders(folder);
  const PassingFolder work(folder);
  std::string why;
  const fs::path file = !entry.npm.empty()   ? bring_npm(entry, work.path(), limits, why)
                        : !entry.url.empty() ? bring_url(entry, work.path(), limits, why)
                                             : bring_package(entry, work.path(), limits, why);
  if (!why.empty()) return unavailable(entry, place, why);
  const fs::path package = package_in(work.path());
  const std::string source = package.empty() ? origin(entry) : package.filename().string();
  if (fs::symlink_status(file).type() != fs::file_type::regular)
    return unavailable(entry, place, source + " holds no file " + entry.path);
  if (const auto sha256 = pipeline::sha256_of_file(file); sha256 != entry.sha256)
    return {Presence::mismatch, place,
            source + " holds other bytes" + (entry.path.empty() ? "" : " in " + entry.path) + " (sha256 " +
                sha256 + ") than the catalogue (" + entry.sha256 +
                (entry.version.empty() ? "" : ", seen in version " + entry.version) + ")"};
  fs::rename(file, place);
  return {Presence::fetched, place, ""};
}

}  // namespace

void Entry::visit(pipeline::Fields& f) {
  f("kind", kind, {"mesh", "cloud"}, "what the file holds");
  f("package", package, {}, "Debian package that holds the file");
  f("version", version, {}, "version of the package in which these bytes were seen");
  f("npm", npm, {}, "npm package that holds the file, of that very version");
  f("url", url, {}, "https address of the file, or of a tar archive with `member`");
  f("shape", shape, {}, "a shape made from a formula (datasets/shapes.h)");
  f("size_m", size_m, {0, 10}, "sizes of the shape");
  f("set", set, {}, "flows may name all objects of a set by one word");
  f("convert", convert, {"none", "javascript"}, "what the file must be turned from");
  f("path", path, {}, "the file inside the package");
  f("member", member, {}, "file inside `path`, when that is a tar archive");
  f("sha256", sha256, {}, "digest of the file");
  f("licence", licence, {}, "SPDX identifier");
  f("unit", unit, {}, "length unit of the file's numbers");
  f("scene", scene, {"object", "table"}, "the object alone, or on a table among others");
  f("cluster", cluster, {0, 100}, "which object of a table scene, the largest first");
  f("up", up, {"x", "y", "z"}, "axis that points up when the object stands; for pictures");
  f("notes", notes, {}, "what it is");
}

std::vector<Entry> load_catalogue(const fs::path& file) {
  std::map<std::string, Entry> entries;
  std::map<std::string, std::string> where;
  std::vector<std::string> mistakes;
  for (const auto& setting : pipeline::read_settings(file)) {
    if (setting.stage.empty()) {
      mistakes.push_back(mistake(setting.where, "", "'" + setting.field + "' stands outside any [object]"));
      continue;
    }
    Entry& entry = entries[setting.stage];
    entry.name = setting.stage;
    where.try_emplace(setting.stage, setting.where);
    pipeline::apply(setting, pipeline::fields_of(entry), mistakes);
  }
  std::vector<Entry> catalogue;
  for (const auto& [name, entry] : entries) {
    check_entry(entry, where[name], mistakes);
    catalogue.push_back(entry);
  }
  if (!mistakes.empty()) throw pipeline::ConfigurationError(mistakes);
  return catalogue;
}

std::vector<Entry> load_catalogue() {
  const char* data = std::getenv("GEOCAGE_DATA");
  auto catalogue = load_catalogue(fs::path(data ? data : GEOCAGE_DATA_DIR) / "datasets" / "catalogue.toml");
  const char* own = std::getenv("GEOCAGE_CATALOGUE");
  if (!own || !*own) return catalogue;
  std::vector<std::string> mistakes;
  for (Entry& entry : load_catalogue(fs::path(own))) {
    if (std::ranges::count(catalogue, entry.name, &Entry::name) > 0)
      mistakes.push_back(mistake(own, entry.name, "the project's catalogue has an object of this name"));
    catalogue.push_back(std::move(entry));
  }
  if (!mistakes.empty()) throw pipeline::ConfigurationError(mistakes);
  return catalogue;
}

const Entry& find_entry(const std::vector<Entry>& catalogue, const std::string& name) {
  const auto entry =
      std::find_if(catalogue.begin(), catalogue.end(), [&](const Entry& e) { return e.name == name; });
  if (entry != catalogue.end()) return *entry;
  std::vector<std::string> names;
  names.reserve(catalogue.size());
  for (const Entry& known : catalogue) names.push_back(known.name);
  throw pipeline::UserError(pipeline::Fault::configuration, name,
                            "the catalogue has no such object" + pipeline::did_you_mean(name, names),
                            "`geocage datasets` lists what there is");
}

fs::path datasets_folder() {
  if (const char* folder = std::getenv("GEOCAGE_DATASETS")) return folder;
  const fs::path sub = fs::path("geocage") / "datasets";
  if (const char* cache = std::getenv("XDG_CACHE_HOME"); cache && *cache) return cache / sub;
  if (const char* home = std::getenv("HOME")) return fs::path(home) / ".cache" / sub;
  throw pipeline::UserError(pipeline::Fault::configuration, "datasets",
                            "none of GEOCAGE_DATASETS, XDG_CACHE_HOME and HOME is set",
                            "say with GEOCAGE_DATASETS where fetched files shall lie");
}

Availability check(const Entry& entry, const fs::path& folder) {
  const PutOff until_cleared_away;
  if (!entry.shape.empty()) return made(entry, folder, false);
  const fs::path place = place_of(entry, folder);
  if (!fs::is_regular_file(place)) return {Presence::unavailable, place, "it has not been fetched yet"};
  const std::string sha256 = pipeline::sha256_of_file(place);
  if (sha256 == entry.sha256) return converted(entry, {Presence::have, place, ""});
  return {Presence::mismatch, place,
          "the file's sha256 is " + sha256 + ", the catalogue's is " + entry.sha256};
}

Availability get(const Entry& entry, const fs::path& folder, const FetchLimits& limits) {
  const PutOff until_cleared_away;
  if (!entry.shape.empty()) return made(entry, folder, true);
  const Availability there = check(entry, folder);
  return there.presence == Presence::have ? there : converted(entry, fetch(entry, folder, limits));
}

}  // namespace geocage::datasets
