#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "pipeline/fields.h"

namespace geocage::datasets {

/// A public object or scan, known by its bytes: a file of a Debian package, of an npm package or at an
/// address; or a shape that is made from a formula.
struct Entry {
  std::string name;
  std::string kind;              ///< "mesh" or "cloud"
  std::string package, version;  ///< the version is where the bytes were seen; others may hold the same
  std::string npm;               ///< npm package, of that very version
  std::string url;               ///< https address of the file, or of a tar archive that holds `member`
  std::string shape;             ///< see make_shape (datasets/shapes.h)
  std::vector<double> size_m;    ///< of the shape
  std::string set;               ///< flows may name all entries of a set by one word
  std::string path;              ///< inside the package, without a leading slash
  std::string member;            ///< when `path` (or what lies at `url`) is a tar archive: the file inside it
  std::string convert = "none";  ///< "javascript": a file of `positions = [[x, y, z], ...]` and `cells`
  std::string sha256, licence;
  std::string unit = "m";        ///< as unit_factor (geometry/mesh_files.h) reads it
  std::string scene = "object";  ///< "object", or "table": the object stands on one, with others around it
  int cluster = 0;               ///< which object of a table scene, the largest first
  std::string up = "z";          ///< axis of the file that points up when the object stands, for pictures
  std::string notes;

  void visit(pipeline::Fields& fields);  ///< all but the name
};

/// The entries of a catalogue file, by name. UserError (configuration) with all mistakes at once, each with
/// its place.
std::vector<Entry> load_catalogue(const std::filesystem::path& file);
/// The project's own catalogue (datasets/catalogue.toml of the source tree, or of the folder in env
/// GEOCAGE_DATA), and behind it the entries of the file in env GEOCAGE_CATALOGUE, if that is set; a name that
/// both have is a UserError (configuration).
std::vector<Entry> load_catalogue();
/// UserError (configuration) for an unknown name; it tells the nearest one.
const Entry& find_entry(const std::vector<Entry>& catalogue, const std::string& name);

/// Where fetched files lie: env GEOCAGE_DATASETS, else geocage/datasets in $XDG_CACHE_HOME, else in ~/.cache.
std::filesystem::path datasets_folder();

enum class Presence {
  have,         ///< it is there, its bytes are right
  fetched,      ///< it was brought just now, its bytes are right
  unavailable,  ///< it isn't there (check), or can't be had (get)
  mismatch      ///< a file is there, or came, with other bytes
};
/// What was found of an entry.
struct Availability {
  Presence presence = Presence::unavailable;
  /// `folder/SHA256/NAME`; holds the right bytes if `have` or `fetched`. Of a shape: `folder/shapes/...`.
  std::filesystem::path file;
  std::string reason;  ///< one sentence, empty if `have` or `fetched`
};

/// Looks for the file and reads it through. std::system_error when a file that is there can't be read.
Availability check(const Entry& entry, const std::filesystem::path& folder);

struct FetchLimits {
  double download_s = 120, unpack_s = 60;
};
/// The file, brought with `apt-get download` and `dpkg-deb -x` (no root, nothing installed), `npm pack` or
/// `curl` when it isn't there; a shape is made. It arrives by one rename, after its bytes were found right;
/// two processes at once do no harm.
Availability get(const Entry& entry, const std::filesystem::path& folder, const FetchLimits& limits = {});

}  // namespace geocage::datasets
