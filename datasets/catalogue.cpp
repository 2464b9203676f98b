#include "datasets/catalogue.h"

#include <algorithm>
#include <cstdlib>
#include <map>
#include <system_error>

#include <unistd.h>

#include "datasets/program.h"
#include "pipeline/digest.h"
#include "pipeline/settings.h"

namespace geocage::datasets {

namespace fs = std::filesystem;
using pipeline::mistake;

namespace {

/// What an entry can't do without, and what would let a fetch write or read outside its folder.
void check_entry(const Entry& entry, const std::string& where, std::vector<std::string>& mistakes) {
  const auto wrong = [&](const std::string& sentence) {
    mistakes.push_back(mistake(where, entry.name, sentence));
  };
  for (const auto& [key, value] : {std::pair{"kind", entry.kind},
                                   {"package", entry.package},
                                   {"path", entry.path},
                                   {"sha256", entry.sha256},
                                   {"licence", entry.licence}})
    if (value.empty()) wrong(std::string("'") + key + "' is missing");
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

/// A folder that goes away with its owner.
class TemporaryFolder {
 public:
  explicit TemporaryFolder(const fs::path& parent) {
    std::string name = (parent / "tmp-XXXXXX").string();
    if (!mkdtemp(name.data())) throw std::system_error(errno, std::generic_category(), name);
    path_ = name;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

fs::path place_of(const Entry& entry, const fs::path& folder) {
  return folder / entry.sha256 / fs::path(entry.member.empty() ? entry.path : entry.member).filename();
}

Availability unavailable(const Entry& entry, const fs::path& place, const std::string& why) {
  return {Presence::unavailable, place, "package " + entry.package + " can't be had: " + why};
}

/// The one .deb of a folder; empty when there is none.
fs::path package_in(const fs::path& folder) {
  for (const auto& file : fs::directory_iterator(folder))
    if (file.path().extension() == ".deb") return file.path();
  return {};
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

Availability fetch(const Entry& entry, const fs::path& folder, const FetchLimits& limits) {
  const fs::path place = place_of(entry, folder);
  fs::create_directories(place.parent_path());
  const TemporaryFolder work(fs::absolute(folder));
  if (const auto why = unpack_package(entry, work.path(), limits); !why.empty())
    return unavailable(entry, place, why);
  fs::path file = work.path() / "root" / entry.path;
  if (!entry.member.empty()) {
    const std::vector<std::string> words = {"tar", "-xf",       file.string(), "-C", work.path().string(),
                                            "--",  entry.member};
    if (const auto why = run_program(words, work.path(), limits.unpack_s).complaint; !why.empty())
      return unavailable(entry, place, why);
    file = work.path() / entry.member;
  }
  const std::string package = package_in(work.path()).filename().string();
  if (fs::symlink_status(file).type() != fs::file_type::regular)
    return unavailable(entry, place, package + " holds no file " + entry.path);
  if (const auto sha256 = pipeline::sha256_of_file(file); sha256 != entry.sha256)
    return {Presence::mismatch, place,
            package + " holds other bytes in " + entry.path + " (sha256 " + sha256 +
                ") than the catalogue (" + entry.sha256 + ", seen in version " + entry.version + ")"};
  fs::rename(file, place);
  return {Presence::fetched, place, ""};
}

}  // namespace

void Entry::visit(pipeline::Fields& f) {
  f("kind", kind, {"mesh", "cloud"}, "what the file holds");
  f("package", package, {}, "Debian package that holds the file");
  f("version", version, {}, "version of the package in which these bytes were seen");
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
  return load_catalogue(fs::path(data ? data : GEOCAGE_DATA_DIR) / "datasets" / "catalogue.toml");
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
  const fs::path place = place_of(entry, folder);
  if (!fs::is_regular_file(place)) return {Presence::unavailable, place, "it has not been fetched yet"};
  const std::string sha256 = pipeline::sha256_of_file(place);
  if (sha256 == entry.sha256) return {Presence::have, place, ""};
  return {Presence::mismatch, place,
          "the file's sha256 is " + sha256 + ", the catalogue's is " + entry.sha256};
}

Availability get(const Entry& entry, const fs::path& folder, const FetchLimits& limits) {
  const Availability there = check(entry, folder);
  return there.presence == Presence::have ? there : fetch(entry, folder, limits);
}

}  // namespace geocage::datasets
