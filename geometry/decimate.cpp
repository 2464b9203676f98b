#include "geometry/decimate.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>

#include <fmt/format.h>
#include <meshoptimizer.h>
#include <nlohmann/json.hpp>

#include "geometry/surface_distance.h"
#include "pipeline/text_file.h"

namespace geocage::geometry {

namespace {

constexpr std::size_t stride = 3 * sizeof(float);

Vec3 vertex(const RawMesh& mesh, unsigned v) {
  return {mesh.xyz[3 * v], mesh.xyz[3 * v + 1], mesh.xyz[3 * v + 2]};
}

/// Only the vertices that triangles have, in the order of their first use.
void drop_unused(RawMesh& mesh) {
  std::vector<unsigned> remap(mesh.vertices());
  const std::size_t used =
      meshopt_optimizeVertexFetchRemap(remap.data(), mesh.corners.data(), mesh.corners.size(), remap.size());
  std::vector<float> xyz(3 * remap.size());
  meshopt_remapVertexBuffer(xyz.data(), mesh.xyz.data(), remap.size(), stride, remap.data());
  meshopt_remapIndexBuffer(mesh.corners.data(), mesh.corners.data(), mesh.corners.size(), remap.data());
  xyz.resize(3 * used);
  mesh.xyz = std::move(xyz);
}

double diagonal_of(const RawMesh& mesh) {
  Vec3 low = vertex(mesh, mesh.corners.front()), high = low;
  for (const unsigned v : mesh.corners) {
    low = low.cwiseMin(vertex(mesh, v));
    high = high.cwiseMax(vertex(mesh, v));
  }
  return (high - low).norm();
}

/// How far given corners lie from the reduced surface; infinite where nothing of it is left.
double lost_by(const RawMesh& given, const RawMesh& reduced) {
  if (reduced.corners.empty()) return std::numeric_limits<double>::infinity();
  const SurfaceDistance surface(in_metres(reduced, 1));
  double most = 0;
  int nearest = 0;
  for (unsigned v = 0; v < given.vertices(); ++v)
    most = std::max(most, surface.distance_m(vertex(given, v), nearest));
  return most;
}

/// Distance of the reduced surface from the given one, of which only `piece` triangles are made ready for
/// distances at a time: 300 bytes each.
double added_by(const RawMesh& given, const TriangleMesh& reduced, double sampling) {
  constexpr std::size_t piece = 1'000'000;
  std::vector<Vec3> samples;
  std::vector<double> distance;  // up to now
  for (int f = 0; f < static_cast<int>(reduced.triangles.size()); ++f)
    for_samples(reduced, f, sampling, [&](const Vec3& p, double) {
      samples.push_back(p);
      distance.push_back(std::numeric_limits<double>::infinity());
      for (int v : reduced.triangles[f])  // corners are given ones
        distance.back() = std::min(distance.back(), (p - reduced.vertices[v]).norm());
    });
  for (std::size_t from = 0; from < given.triangles(); from += piece) {
    RawMesh part;
    part.corners.assign(
        given.corners.begin() + static_cast<std::ptrdiff_t>(3 * from),
        given.corners.begin() + static_cast<std::ptrdiff_t>(3 * std::min(given.triangles(), from + piece)));
    std::vector<unsigned> number(given.vertices(), ~0u);
    for (unsigned& v : part.corners) {
      if (number[v] == ~0u) {
        number[v] = static_cast<unsigned>(part.vertices());
        part.xyz.insert(part.xyz.end(), given.xyz.begin() + 3 * static_cast<std::ptrdiff_t>(v),
                        given.xyz.begin() + 3 * static_cast<std::ptrdiff_t>(v) + 3);
      }
      v = number[v];
    }
    const SurfaceDistance surface(in_metres(part, 1));
    for (std::size_t k = 0; k < samples.size(); ++k)
      distance[k] = surface.distance_within(samples[k], distance[k]);
  }
  return distance.empty() ? 0 : *std::max_element(distance.begin(), distance.end());
}

constexpr std::pair<const char*, double Decimation::*> lengths[] = {
    {"lost", &Decimation::lost}, {"added", &Decimation::added}, {"sampling", &Decimation::sampling}};

}  // namespace

void save(const Decimation& done, const std::filesystem::path& file) {
  nlohmann::json json = {{"before", done.before}, {"after", done.after}, {"clustered", done.clustered}};
  for (const auto& [name, member] : lengths) json[name] = done.*member;
  pipeline::write_text(file, json.dump());
}

Decimation load_decimation(const std::filesystem::path& file) {
  const auto json = nlohmann::json::parse(std::ifstream(file));
  Decimation done{json.at("before"), json.at("after"), json.at("clustered")};
  for (const auto& [name, member] : lengths) done.*member = json.at(name);
  return done;
}

void tell(const Decimation& done, pipeline::Run& run) {
  run.metric("decimated_from", static_cast<double>(done.before));
  run.metric("decimated_to", static_cast<double>(done.after));
  run.metric("decimated_clustered", done.clustered);
  for (const auto& [name, member] : lengths) run.metric(fmt::format("decimated_{}_m", name), done.*member);
  run.log(fmt::format("{} faces reduced to {}{}, which moved the surface by {:.3g} mm at most", done.before,
                      done.after, done.clustered ? " with the help of a grid" : "",
                      1000 * std::max(done.lost, done.added)));
}

void weld(RawMesh& mesh) {
  for (float& x : mesh.xyz) x += 0.0F;  // -0 is 0
  const std::size_t count = mesh.vertices();
  std::vector<unsigned> remap(count);
  const std::size_t left =
      meshopt_generateVertexRemap(remap.data(), nullptr, count, mesh.xyz.data(), count, stride);
  for (std::size_t v = 0; v < count; ++v)  // to the front, so in place
    for (std::size_t k = 0; k < 3; ++k) mesh.xyz[3 * remap[v] + k] = mesh.xyz[3 * v + k];
  mesh.xyz.resize(3 * left);
  mesh.xyz.shrink_to_fit();
  std::size_t kept = 0;
  for (std::size_t i = 0; i < mesh.corners.size(); i += 3) {
    unsigned t[3];
    for (std::size_t k = 0; k < 3; ++k) t[k] = remap[mesh.corners[i + k]];
    if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) continue;
    for (const unsigned v : t) mesh.corners[kept++] = v;
  }
  mesh.corners.resize(kept);
}

TriangleMesh in_metres(const RawMesh& mesh, double scale_to_m) {
  TriangleMesh out;
  out.vertices.reserve(mesh.vertices());
  for (unsigned v = 0; v < mesh.vertices(); ++v) out.vertices.push_back(scale_to_m * vertex(mesh, v));
  out.triangles.reserve(mesh.triangles());
  for (std::size_t i = 0; i < mesh.corners.size(); i += 3)
    out.triangles.push_back({static_cast<int>(mesh.corners[i]), static_cast<int>(mesh.corners[i + 1]),
                             static_cast<int>(mesh.corners[i + 2])});
  return out;
}

Decimation decimate(RawMesh& mesh, std::size_t triangles) {
  constexpr float any_error = std::numeric_limits<float>::max();
  const auto by = [&](auto simplify) {
    RawMesh reduced{mesh.xyz, std::vector<unsigned>(mesh.corners.size())};
    reduced.corners.resize(simplify(reduced.corners.data(), mesh.corners.data(), mesh.corners.size(),
                                    mesh.xyz.data(), mesh.vertices(), stride, 3 * triangles));
    drop_unused(reduced);
    return reduced;
  };
  const double size = diagonal_of(mesh);
  Decimation done{.before = mesh.triangles(), .sampling = 0.005 * size};
  RawMesh reduced = by([](auto... given) { return meshopt_simplify(given..., any_error, 0U, nullptr); });
  done.lost = lost_by(mesh, reduced);
  // A soup's triangles, which share no edges, vanish one by one, or stay.
  if (reduced.triangles() > triangles + triangles / 10 || done.lost > 0.02 * size) {
    RawMesh clustered =
        by([](auto... given) { return meshopt_simplifySloppy(given..., any_error, nullptr); });
    const double lost = lost_by(mesh, clustered);
    done.clustered = lost < done.lost || reduced.triangles() > triangles + triangles / 10;
    if (done.clustered) {
      done.lost = lost;
      reduced = std::move(clustered);
    }
  }
  done.after = reduced.triangles();
  if (done.after > 0) done.added = added_by(mesh, in_metres(reduced, 1), done.sampling);
  mesh = std::move(reduced);
  return done;
}

}  // namespace geocage::geometry
