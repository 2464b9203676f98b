#include "geometry/mesh_files.h"

#include <algorithm>
#include <cmath>
#include <map>

#include <assimp/Importer.hpp>
#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>

#include "geometry/file_guards.h"
#include "pipeline/error.h"

namespace geocage::geometry {

namespace fs = std::filesystem;
using pipeline::Fault;
using pipeline::UserError;

namespace {

/// All triangles of a scene, their corners not yet welded.
TriangleMesh triangles_of(const aiScene& scene, double scale) {
  TriangleMesh mesh;
  for (unsigned m = 0; m < scene.mNumMeshes; ++m) {
    const aiMesh& part = *scene.mMeshes[m];
    const int first = static_cast<int>(mesh.vertices.size());
    for (unsigned v = 0; v < part.mNumVertices; ++v) {
      const aiVector3D& p = part.mVertices[v];
      mesh.vertices.emplace_back(scale * p.x, scale * p.y, scale * p.z);
    }
    for (unsigned f = 0; f < part.mNumFaces; ++f) {
      const aiFace& face = part.mFaces[f];
      if (face.mNumIndices != 3) continue;  // points and lines
      std::array<int, 3> t;
      for (int i = 0; i < 3; ++i) t[i] = first + static_cast<int>(face.mIndices[i]);
      mesh.triangles.push_back(t);
    }
  }
  return mesh;
}

/// Vertices at the very same place become one; triangles that lose a corner by it go. Formats such as STL,
/// and meshes with texture seams, repeat their vertices.
TriangleMesh weld(const TriangleMesh& mesh) {
  TriangleMesh welded;
  std::map<std::array<double, 3>, int> known;
  std::vector<int> renamed(mesh.vertices.size());
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const Vec3& p = mesh.vertices[v];
    const auto [it, fresh] =
        known.try_emplace({p.x() + 0.0, p.y() + 0.0, p.z() + 0.0}, static_cast<int>(welded.vertices.size()));
    if (fresh) welded.vertices.push_back(p);
    renamed[v] = it->second;
  }
  for (auto t : mesh.triangles) {
    for (int& v : t) v = renamed[v];
    if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) welded.triangles.push_back(t);
  }
  return welded;
}

void guard_sizes(const fs::path& file) {
  guard_file(file);
  const std::string ending = ending_of(file);
  const std::uint64_t faces = ending == ".ply" ? guard_ply(file).faces : 0;
  if (ending == ".stl") guard_stl(file);
  if (ending == ".obj" || ending == ".off" || ending == ".stl" || ending == ".ply") guard_text_mesh(file);
  // No format spends less than 12 bytes on a triangle.
  if (faces > most_faces || fs::file_size(file) / 12 > 20 * most_faces)
    throw UserError(Fault::input, file.string(), "this mesh has more than 10 million faces",
                    "decimate it first");
}

void refuse_bad_numbers(const fs::path& file, const TriangleMesh& mesh) {
  const int count = static_cast<int>(mesh.vertices.size());
  for (int v = 0; v < count; ++v)
    if (!mesh.vertices[v].allFinite())
      throw UserError(Fault::input, file.string(), fmt::format("vertex {} is not a finite point", v),
                      "mend the file");
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f)
    for (int v : mesh.triangles[f])
      if (v < 0 || v >= count)
        throw UserError(Fault::input, file.string(),
                        fmt::format("face {} names vertex {}, but there are {}", f, v, count),
                        "mend the file");
}

}  // namespace

TriangleMesh read_mesh(const fs::path& file, double scale_to_m) {
  guard_sizes(file);
  Assimp::Importer importer;
  importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE, aiPrimitiveType_POINT | aiPrimitiveType_LINE);
  const aiScene* scene =
      importer.ReadFile(file.string(), aiProcess_ValidateDataStructure | aiProcess_Triangulate |
                                           aiProcess_PreTransformVertices | aiProcess_SortByPType);
  if (!scene)
    throw UserError(Fault::input, file.string(),
                    std::string("no mesh can be read from it: ") + importer.GetErrorString(),
                    "check that the ending fits the content");
  TriangleMesh mesh = triangles_of(*scene, scale_to_m);
  refuse_bad_numbers(file, mesh);
  mesh = weld(mesh);
  if (mesh.triangles.empty())
    throw UserError(Fault::input, file.string(), "it holds no triangles", "is it a cloud?");
  return mesh;
}

bool is_mesh_ending(const std::string& ending) {
  return !ending.empty() && Assimp::Importer().IsExtensionSupported(ending);
}

void guard_units(const std::string& where, double diagonal) {
  constexpr double smallest = 0.005, largest = 5;
  if (diagonal >= smallest && diagonal <= largest) return;
  std::string fits;
  for (const auto& [factor, unit] : {std::pair{0.001, "mm"}, {0.01, "cm"}, {0.0254, "inch"}})
    if (diagonal * factor >= smallest && diagonal * factor <= largest)
      fits += fmt::format("{}{} (unit {})", fits.empty() ? "" : ", ", factor, unit);
  throw UserError(
      Fault::input, where,
      fmt::format("its diagonal is {:.4g} m, which no hand can hold: sizes from 0.005 m to 5 m are taken",
                  diagonal),
      fits.empty() ? "no common unit fits; check the file"
                   : "factors that would fit: " + fits + "; say it with --units or import.unit");
}

double unit_factor(const std::string& unit) {
  static const std::map<std::string, double> factors = {
      {"m", 1}, {"cm", 0.01}, {"mm", 0.001}, {"inch", 0.0254}};
  if (const auto it = factors.find(unit); it != factors.end()) return it->second;
  try {
    std::size_t used = 0;
    const double factor = std::stod(unit, &used);
    if (used == unit.size() && std::isfinite(factor) && factor > 0) return factor;
  } catch (const std::logic_error&) {  // not a number
  }
  throw UserError(Fault::configuration, "unit '" + unit + "'", "this is no unit",
                  "say m, cm, mm, inch, or metres per unit");
}

}  // namespace geocage::geometry
