#include "hands/urdf_mesh.h"

#include <cstdlib>
#include <sstream>
#include <vector>

#include "geometry/mesh_files.h"
#include "pipeline/error.h"

namespace geocage::hands {

namespace fs = std::filesystem;

namespace {

/// The folders in which packages lie, or which are one.
std::vector<fs::path> package_roots(const fs::path& urdf_folder) {
  std::vector<fs::path> roots;
  for (const char* variable : {"GEOCAGE_PACKAGE_PATH", "ROS_PACKAGE_PATH"}) {
    const char* list = std::getenv(variable);
    std::istringstream folders(list ? list : "");
    for (std::string folder; std::getline(folders, folder, ':');)
      if (!folder.empty()) roots.emplace_back(folder);
  }
  fs::path folder = urdf_folder;
  for (; folder.has_relative_path(); folder = folder.parent_path()) roots.push_back(folder);
  return roots;
}

std::vector<fs::path> places_of(const std::string& uri, const fs::path& urdf_folder) {
  const auto scheme_end = uri.find("://");
  if (scheme_end == std::string::npos) return {urdf_folder / uri};
  const std::string scheme = uri.substr(0, scheme_end);
  const fs::path rest = uri.substr(scheme_end + 3);
  if (scheme == "file") return {rest};
  if (scheme != "package" && scheme != "model") return {};
  const fs::path package = *rest.begin(), inside = rest.lexically_relative(package);
  std::vector<fs::path> places;
  for (const fs::path& root : package_roots(urdf_folder)) {
    places.push_back(root / rest);
    if (root.filename() == package) places.push_back(root / inside);
  }
  return places;
}

}  // namespace

fs::path find_mesh(const LinkMesh& mesh, const KinematicTree& tree, const fs::path& urdf) {
  const fs::path folder = fs::absolute(urdf).parent_path().lexically_normal();
  const auto places = mesh.uri.empty() ? std::vector<fs::path>{} : places_of(mesh.uri, folder);
  for (const fs::path& place : places)
    if (fs::is_regular_file(place)) return place;
  const bool package = mesh.uri.starts_with("package://") || mesh.uri.starts_with("model://");
  throw pipeline::UserError(
      pipeline::Fault::configuration, urdf.string(),
      "link '" + tree.links[mesh.link] + "': there is no file for mesh '" + mesh.uri + "'",
      package ? "name the folder that holds the package in GEOCAGE_PACKAGE_PATH; sought in that, in "
                "ROS_PACKAGE_PATH and from " +
                    folder.string() + " upwards"
      : places.empty() ? "use a path, file:// or package://"
                       : "sought at " + places.front().string());
}

geometry::TriangleMesh read_link_mesh(const LinkMesh& mesh) {
  geometry::TriangleMesh read = geometry::read_mesh(mesh.file);
  for (Vec3& p : read.vertices) p = mesh.X_LM * mesh.scale.cwiseProduct(p);
  if (mesh.scale.prod() < 0)
    for (auto& triangle : read.triangles) std::swap(triangle[1], triangle[2]);
  return read;
}

}  // namespace geocage::hands
