#include "geometry/mesh_files.h"

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
RawMesh triangles_of(const aiScene& scene) {
  RawMesh mesh;
  std::size_t vertices = 0, faces = 0;
  for (unsigned m = 0; m < scene.mNumMeshes; ++m) {
    vertices += scene.mMeshes[m]->mNumVertices;
    faces += scene.mMeshes[m]->mNumFaces;
  }
  mesh.xyz.reserve(3 * vertices);
  mesh.corners.reserve(3 * faces);
  for (unsigned m = 0; m < scene.mNumMeshes; ++m) {
    const aiMesh& part = *scene.mMeshes[m];
    const auto first = static_cast<unsigned>(mesh.vertices());
    for (unsigned v = 0; v < part.mNumVertices; ++v) {
      const aiVector3D& p = part.mVertices[v];
      mesh.xyz.insert(mesh.xyz.end(), {p.x, p.y, p.z});
    }
    for (unsigned f = 0; f < part.mNumFaces; ++f) {
      const aiFace& face = part.mFaces[f];
      if (face.mNumIndices != 3) continue;  // points and lines
      for (int i = 0; i < 3; ++i) mesh.corners.push_back(first + face.mIndices[i]);
    }
  }
  return mesh;
}

[[noreturn]] void refuse_faces(const fs::path& file, std::uint64_t faces, const FaceGuard& guard) {
  throw UserError(
      Fault::input, file.string(),
      fmt::format("this mesh has {} faces, and {} are taken at most", faces, guard.most_faces),
      "say import.decimate = 500000 (score and evaluate: --decimate) to have it reduced to so many, "
      "or decimate it first");
}

void guard_sizes(const fs::path& file, const FaceGuard& guard) {
  guard_file(file);
  const std::string ending = ending_of(file);
  if (ending == ".obj" || ending == ".off" || ending == ".stl" || ending == ".ply") guard_text_mesh(file);
  if (ending == ".stl") guard_stl(file);
  if (ending == ".off") guard_off(file);
  const std::uint64_t faces = declared_faces(file);
  if (guard.decimate_to > 0) return;  // the worker's memory is the limit
  if (faces > guard.most_faces) refuse_faces(file, faces, guard);
  // No format spends less than 12 bytes on a triangle.
  if (fs::file_size(file) / 12 > 20 * guard.most_faces)
    throw UserError(Fault::input, file.string(),
                    fmt::format("its {} MB are too much for a mesh of {} faces, which are taken at most",
                                fs::file_size(file) / 1000000, guard.most_faces),
                    "say import.decimate = 500000 to have it reduced to so many faces");
}

/// assimp takes the first byte of a binary PLY's numbers for a line's end when it looks like one; after a
/// header that ends in CR LF it expects just that.
const aiScene* read_scene(Assimp::Importer& importer, const fs::path& file) {
  constexpr unsigned steps = aiProcess_ValidateDataStructure | aiProcess_Triangulate |
                             aiProcess_PreTransformVertices | aiProcess_SortByPType;
  if (ending_of(file) == ".ply")
    if (const auto text = ply_with_cr(file); !text.empty())
      return importer.ReadFileFromMemory(text.data(), text.size(), steps, "ply");
  return importer.ReadFile(file.string(), steps);
}

void refuse_bad_numbers(const fs::path& file, const RawMesh& mesh) {
  for (std::size_t i = 0; i < mesh.xyz.size(); ++i)
    if (!std::isfinite(mesh.xyz[i]))
      throw UserError(Fault::input, file.string(), fmt::format("vertex {} is not a finite point", i / 3),
                      "mend the file");
  for (std::size_t i = 0; i < mesh.corners.size(); ++i)
    if (mesh.corners[i] >= mesh.vertices())
      throw UserError(
          Fault::input, file.string(),
          fmt::format("face {} names vertex {}, but there are {}", i / 3, mesh.corners[i], mesh.vertices()),
          "mend the file");
}

}  // namespace

MeshOfFile read_mesh(const fs::path& file, double scale_to_m, const FaceGuard& guard) {
  guard_sizes(file, guard);
  RawMesh raw;
  {
    Assimp::Importer importer;
    importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE, aiPrimitiveType_POINT | aiPrimitiveType_LINE);
    const aiScene* scene = read_scene(importer, file);
    if (!scene && std::string(importer.GetErrorString()).find("mNumMeshes is 0") != std::string::npos)
      throw UserError(Fault::input, file.string(), "its reader finds no mesh in it",
                      "is it a cloud? Else check that the ending fits the content, and that text is plain "
                      "ASCII or UTF-8");
    if (!scene)
      throw UserError(Fault::input, file.string(),
                      std::string("no mesh can be read from it: ") + importer.GetErrorString(),
                      "check that the ending fits the content");
    raw = triangles_of(*scene);
  }
  refuse_bad_numbers(file, raw);
  weld(raw);
  if (raw.corners.empty())
    throw UserError(Fault::input, file.string(), "it holds no triangles", "is it a cloud?");
  MeshOfFile read;
  if (raw.triangles() > guard.most_faces) {
    if (guard.decimate_to == 0) refuse_faces(file, raw.triangles(), guard);
    read.decimated = decimate(raw, guard.decimate_to);
    if (raw.corners.empty())
      throw UserError(Fault::input, file.string(), "nothing is left of it when it is reduced",
                      "ask for more faces by import.decimate");
    for (double* length : {&read.decimated->lost, &read.decimated->added, &read.decimated->sampling})
      *length *= scale_to_m;
  }
  read.mesh = in_metres(raw, scale_to_m);
  return read;
}

TriangleMesh read_mesh(const fs::path& file, double scale_to_m) {
  return read_mesh(file, scale_to_m, {}).mesh;
}

bool is_mesh_ending(const std::string& ending) {
  return !ending.empty() && Assimp::Importer().IsExtensionSupported(ending);
}

void guard_units(const std::string& where, double diagonal) {
  constexpr double smallest = 0.005, largest = 5;
  if (diagonal >= smallest && diagonal <= largest) return;
  if (diagonal == 0)
    throw UserError(Fault::input, where, "all its points lie at one place", "write the file anew");
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
