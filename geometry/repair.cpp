#include "geometry/repair.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <set>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "geometry/crossings.h"
#include "geometry/holes.h"
#include "geometry/soup.h"
#include "geometry/surface_distance.h"
#include "geometry/wrap.h"
#include "pipeline/error.h"
#include "pipeline/text_file.h"
#include "pipeline/worker.h"

namespace geocage::geometry {

namespace {

constexpr std::size_t most_named = 8;
constexpr double most_extent_m = 1e6;  ///< beyond it nothing is an object

constexpr std::pair<const char*, int RepairCounts::*> count_names[] = {
    {"bad_indices", &RepairCounts::bad_indices},
    {"not_finite", &RepairCounts::not_finite},
    {"degenerate", &RepairCounts::degenerate},
    {"duplicate", &RepairCounts::duplicate},
    {"welded", &RepairCounts::welded},
    {"isolated", &RepairCounts::isolated},
    {"t_junctions", &RepairCounts::t_junctions},
    {"turned", &RepairCounts::turned},
    {"split", &RepairCounts::split},
    {"parts", &RepairCounts::parts},
    {"holes", &RepairCounts::holes},
    {"crossing", &RepairCounts::crossing}};

double diagonal_of(const TriangleMesh& mesh) {
  if (mesh.vertices.empty()) return 0;
  Vec3 low = mesh.vertices.front(), high = low;
  for (const Vec3& p : mesh.vertices) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  return (high - low).norm();
}

/// Takes out triangles that cross others with `rings` rings around them, and fills what that leaves open;
/// false when more than `most_share` of the triangles would go.
bool cut_crossings_out(TriangleMesh& mesh, const std::vector<std::pair<int, int>>& pairs, int rings,
                       RepairCounts& counts) {
  constexpr double most_share = 0.3;
  std::vector<char> keep(mesh.triangles.size(), 1);
  for (const auto& [f, g] : pairs) keep[f] = keep[g] = 0;
  for (int ring = 0; ring < rings; ++ring) {
    std::vector<char> near(mesh.vertices.size(), 0);
    for (std::size_t f = 0; f < keep.size(); ++f)
      if (!keep[f])
        for (int v : mesh.triangles[f]) near[v] = 1;
    for (std::size_t f = 0; f < keep.size(); ++f)
      for (int v : mesh.triangles[f])
        if (near[v]) keep[f] = 0;
  }
  const auto gone = std::count(keep.begin(), keep.end(), 0);
  if (static_cast<double>(gone) > most_share * static_cast<double>(keep.size())) return false;
  counts.crossing += static_cast<int>(gone);
  mesh = kept_triangles(mesh, keep);
  return true;
}

/// Closes the sheets and takes crossings out, round by round with more around them; what is reached is in
/// `mesh`, whether or not it is a solid. In a worker process.
void close_and_untangle(TriangleMesh& mesh, const RepairParams& params, RepairCounts& counts) {
  constexpr int rings[] = {0, 0, 1, 1, 2, 3, 4, 6};
  mesh = cut_to_manifold(mesh, counts);
  const int parts = drop_parts(mesh, params.smallest_part, params.parts == "largest", counts);
  part_touching_vertices(mesh);
  counts.holes += fill_holes(mesh, static_cast<int>(mesh.triangles.size()));
  if (parts != 1) return;
  const TriangleMesh closed = mesh;
  for (int around : rings) {
    const auto pairs = crossing_triangles(mesh);
    if (pairs.empty() && check_mesh(mesh).closed_manifold()) return;
    if (!cut_crossings_out(mesh, pairs, around, counts)) break;
    mesh = cut_to_manifold(mesh, counts);
    drop_parts(mesh, 0, true, counts);
    part_touching_vertices(mesh);
    counts.holes += fill_holes(mesh, static_cast<int>(mesh.triangles.size()));
  }
  if (!crossing_triangles(mesh, 1).empty()) mesh = closed;  // the wrap had better start from there
}

void save_counts(const RepairCounts& counts, const std::filesystem::path& dir) {
  nlohmann::json json;
  for (const auto& [name, member] : count_names) json[name] = counts.*member;
  pipeline::write_text(dir / "counts.json", json.dump());
}

RepairCounts load_counts(const std::filesystem::path& dir) {
  const auto json = nlohmann::json::parse(std::ifstream(dir / "counts.json"));
  RepairCounts counts;
  for (const auto& [name, member] : count_names) counts.*member = json.at(name).get<int>();
  return counts;
}

/// A repair under way.
class Repairer {
 public:
  Repairer(const TriangleMesh& mesh, const RepairParams& params) : given_(mesh), params_(params) {}

  Repair make() {
    for (const Vec3& p : given_.vertices)
      if (p.allFinite() && p.cwiseAbs().maxCoeff() > most_extent_m) {
        rejected(fmt::format("a vertex lies {:.3g} m away", p.cwiseAbs().maxCoeff()));
        return repair_;
      }
    repair_.reason = flaw_of_solid(given_, &repair_.triangles);
    if (repair_.reason.empty()) {
      repair_.outcome = RepairOutcome::untouched;
      repair_.mesh = given_;
      return repair_;
    }
    if (!clean()) return repair_;
    TriangleMesh mesh = mended();
    if (flaw_of_solid(mesh).empty()) {
      measure(mesh);
      return accepted(RepairOutcome::repaired, std::move(mesh));
    }
    return wrapped(mesh);
  }

 private:
  /// What can be worked with, in `soup_`; false when there is nothing.
  bool clean() {
    // Its own box: vertices that no sound triangle has must not set the scale.
    diagonal_m_ = diagonal_of(sound_part(given_));
    if (!(diagonal_m_ > 0)) return rejected("no triangle with an area is left");
    soup_ = clean_soup(given_, params_.weld * diagonal_m_, repair_.counts);
    return !soup_.triangles.empty() || rejected("no triangle with an area is left");
  }

  /// Mended as far as it goes; not a solid where that was not far enough.
  TriangleMesh mended() {
    TriangleMesh mesh;
    contained(
        "mending",
        [&](const std::filesystem::path& dir) {
          TriangleMesh work = soup_;
          RepairCounts counts = repair_.counts;
          close_and_untangle(work, params_, counts);
          save_artefact(work, dir);
          save_counts(counts, dir);
        },
        mesh);
    if (orient_outward(mesh))
      repair_.counts.turned = std::max(0, static_cast<int>(mesh.triangles.size()) - repair_.counts.turned);
    return mesh;
  }

  Repair wrapped(const TriangleMesh& closed) {
    const TriangleMesh& around = closed.triangles.empty() ? soup_ : closed;
    const double alpha = params_.wrap_alpha * diagonal_m_;
    TriangleMesh wrap;
    contained(
        "wrapping",
        [&](const std::filesystem::path& dir) {
          save_artefact(wrapped_surface(around, alpha, alpha / 20, params_.seed), dir);
        },
        wrap);
    if (wrap.triangles.empty()) return repair_;
    const int parts = drop_parts(wrap, params_.smallest_part, params_.parts == "largest", repair_.counts);
    if (parts > 1) {
      rejected(fmt::format("its {} parts do not touch: each is an object of its own", parts));
      return repair_;
    }
    orient_outward(wrap);
    if (const std::string flaw = flaw_of_solid(wrap); !flaw.empty()) {
      rejected("the wrap is no solid either: " + flaw);
      return repair_;
    }
    const double sampling_m = 0.005 * diagonal_m_, most_m = params_.most_moved * diagonal_m_;
    if (const double d = deviation(wrap, SurfaceDistance(around), sampling_m).max_m; d > most_m) {
      rejected(
          fmt::format("a wrap would lie up to {:.4g} m from the surface, {:.4g} m are allowed", d, most_m));
      return repair_;
    }
    // A skin round a sheet is two offsets thick: V = A offset.
    const MeshReport report = check_mesh(wrap);
    if (report.volume_m3 < 1.5 * alpha / 20 * report.area_m2) {
      rejected("it is a sheet without an inside");
      return repair_;
    }
    measure(wrap);
    return accepted(RepairOutcome::wrapped, std::move(wrap));
  }

  void contained(const char* what, const std::function<void(const std::filesystem::path&)>& work,
                 TriangleMesh& mesh) {
    try {
      pipeline::run_contained(
          {.seconds = params_.timeout_s, .memory_gib = params_.memory_gib, .patience = 20}, "repair", work,
          [&](const std::filesystem::path& dir) {
            load_artefact(mesh, dir);
            if (exists(dir / "counts.json")) repair_.counts = load_counts(dir);
          });
    } catch (const pipeline::UserError& error) {
      rejected(std::string(what) + " it failed: " + error.sentence());
    }
  }

  void measure(const TriangleMesh& result) {
    const TriangleMesh given = sound_part(given_);
    repair_.sampling_m = 0.005 * diagonal_m_;
    repair_.lost_m = deviation(given, SurfaceDistance(result), repair_.sampling_m).max_m;
    repair_.added_m = deviation(result, SurfaceDistance(given), repair_.sampling_m).max_m;
  }

  bool rejected(const std::string& why) {
    repair_.reason += (repair_.reason.empty() ? "" : "; ") + why;
    return false;
  }

  Repair accepted(RepairOutcome outcome, TriangleMesh mesh) {
    repair_.outcome = outcome;
    repair_.mesh = std::move(mesh);
    return repair_;
  }

  const TriangleMesh& given_;
  const RepairParams& params_;
  Repair repair_;
  TriangleMesh soup_;
  double diagonal_m_ = 0;
};

}  // namespace

std::string_view to_string(RepairOutcome outcome) {
  constexpr std::string_view words[] = {"untouched", "repaired", "wrapped", "rejected"};
  return words[static_cast<int>(outcome)];
}

std::string flaw_of_solid(const TriangleMesh& mesh, std::vector<int>* triangles) {
  const MeshReport report = check_mesh(mesh);
  if (triangles) *triangles = report.offenders;
  if (!report.closed_manifold()) return flaw(report);
  if (report.components > 1) return fmt::format("it has {} separate parts", report.components);
  if (report.isolated_vertices > 0)
    return fmt::format("{} vertices belong to no triangle", report.isolated_vertices);
  if (!(report.volume_m3 > 0)) return "its triangles face inwards";
  const auto pairs = crossing_triangles(mesh, most_named);
  if (pairs.empty()) return "";
  if (triangles)
    for (const auto& [f, g] : pairs) triangles->insert(triangles->end(), {f, g});
  return pairs[0].first == pairs[0].second
             ? fmt::format("triangle {} has its corners on a line", pairs[0].first)
             : fmt::format("triangles {} and {} cut each other", pairs[0].first, pairs[0].second);
}

Repair repair_mesh(const TriangleMesh& mesh, const RepairParams& params) {
  return Repairer(mesh, params).make();
}

void tell(const Repair& repair, pipeline::Run& run) {
  run.metric("repair_outcome", static_cast<double>(repair.outcome));
  for (const auto& [name, member] : count_names)
    if (repair.counts.*member != 0) run.metric(std::string("repair_") + name, repair.counts.*member);
  if (repair.outcome != RepairOutcome::repaired && repair.outcome != RepairOutcome::wrapped) return;
  run.metric("repair_lost_m", repair.lost_m);
  run.metric("repair_added_m", repair.added_m);
  run.metric("repair_sampling_m", repair.sampling_m);
  run.log(fmt::format("surface {}: {}", to_string(repair.outcome), repair.reason));
}

}  // namespace geocage::geometry
