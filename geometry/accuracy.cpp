#include "geometry/accuracy.h"

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <system_error>

#include <nlohmann/json.hpp>

#include "geometry/repair.h"
#include "geometry/surface_distance.h"
#include "pipeline/text_file.h"

namespace geocage::geometry {

namespace {

/// Mean distances of vertices that were observed by half or more, and of the others.
void compare_observed(const TriangleMesh& surface, const SurfaceDistance& truth, Accuracy& accuracy) {
  double sum[2] = {0, 0};
  int count[2] = {0, 0}, nearest = 0;
  for (std::size_t v = 0; v < surface.vertices.size(); ++v) {
    const int observed = surface.observed.empty() || surface.observed[v] >= 0.5;
    sum[observed] += truth.distance_m(surface.vertices[v], nearest);
    ++count[observed];
  }
  if (count[0] > 0) accuracy.guessed_mean_m = sum[0] / count[0];
  if (count[1] > 0) accuracy.observed_mean_m = sum[1] / count[1];
  accuracy.observed_share = static_cast<double>(count[1]) / std::max(1, count[0] + count[1]);
}

template <class Visit>
void for_each_number(Accuracy& a, Visit visit) {
  visit("diagonal_m", a.diagonal_m);
  visit("sampling_m", a.sampling_m);
  visit("off_max_m", a.off_max_m);
  visit("off_mean_m", a.off_mean_m);
  visit("missing_max_m", a.missing_max_m);
  visit("missing_mean_m", a.missing_mean_m);
  visit("observed_mean_m", a.observed_mean_m);
  visit("guessed_mean_m", a.guessed_mean_m);
  visit("observed_share", a.observed_share);
  visit("genus", a.genus);
  visit("true_genus", a.true_genus);
  visit("solid", a.solid);
}

}  // namespace

double Accuracy::hausdorff_m() const {
  return std::max(off_max_m, missing_max_m);
}
double Accuracy::mean_m() const {
  return (off_mean_m + missing_mean_m) / 2;
}

Accuracy accuracy_of(const TriangleMesh& surface, const TriangleMesh& truth, double sampling_m) {
  Accuracy accuracy;
  const MeshReport report = check_mesh(truth);
  accuracy.diagonal_m = report.diagonal_m();
  accuracy.sampling_m = sampling_m;
  accuracy.true_genus = 1 - report.euler / 2;
  accuracy.genus = 1 - check_mesh(surface).euler / 2;
  accuracy.solid = flaw_of_solid(surface).empty();
  const SurfaceDistance to_truth(truth), to_surface(surface);
  const Deviation off = deviation(surface, to_truth, sampling_m);
  const Deviation missing = deviation(truth, to_surface, sampling_m);
  accuracy.off_max_m = off.max_m;
  accuracy.off_mean_m = off.mean_m;
  accuracy.missing_max_m = missing.max_m;
  accuracy.missing_mean_m = missing.mean_m;
  compare_observed(surface, to_truth, accuracy);
  return accuracy;
}

std::string_view artefact_kind(const Accuracy*) {
  return "accuracy";
}

void save_artefact(const Accuracy& accuracy, const std::filesystem::path& dir) {
  nlohmann::ordered_json json = {{"schema", "geocage-accuracy 1"}};
  Accuracy copy = accuracy;
  for_each_number(copy, [&](const char* name, const auto& value) { json[name] = value; });
  pipeline::write_text(dir / "accuracy.json", json.dump(2) + "\n");
}

void load_artefact(Accuracy& accuracy, const std::filesystem::path& dir) {
  std::ifstream in(dir / "accuracy.json");
  if (!in) throw std::system_error(errno, std::generic_category(), (dir / "accuracy.json").string());
  const auto json = nlohmann::json::parse(in);
  for_each_number(accuracy, [&](const char* name, auto& value) { json.at(name).get_to(value); });
}

}  // namespace geocage::geometry
