#include "tests/bench/study_grasps.h"

#include <algorithm>
#include <cstdio>
#include <sstream>

#include "geometry/noise.h"
#include "pipeline/error.h"
#include "stages/balls/balls.h"
#include "stages/field/field.h"
#include "stages/place/place.h"
#include "stages/remesh/remesh.h"
#include "stages/score/score.h"
#include "tests/bench/study_objects.h"

namespace geocage::bench {
namespace {

hands::GraspSet grasps_of(const geometry::TriangleMesh& surface, const StudyOptions& options,
                          const hands::Hand& hand, const std::string& object) {
  pipeline::Run run;
  stages::BallsParams balls_params;
  balls_params.radii_m = {hand.ball_radius_m};
  const auto balls = stages::balls(balls_params, run, surface);
  const auto scores = stages::score({}, run, surface, balls);
  const auto field = stages::field({}, run, surface);
  stages::PlaceParams place;
  place.object = object;
  place.max_grasps = options.grasps;
  return stages::place(place, run, scores, field, {}, {}, hand);
}

}  // namespace

bool read_study_option(StudyOptions& options, const std::string& key, const std::string& value) {
  if (key == "--hand") return options.hand = value, true;
  if (key == "--noise") return options.noise_m = std::stod(value), true;
  if (key == "--seeds") return options.seeds = std::stoi(value), true;
  if (key == "--grasps") return options.grasps = std::stoi(value), true;
  if (key != "--only") return false;
  std::istringstream names(value);
  for (std::string name; std::getline(names, name, ',');) options.only.push_back(name);
  return true;
}

std::vector<StudyObject> study_grasps(const StudyOptions& options, const hands::Hand& hand) {
  std::vector<StudyObject> all;
  for (auto& [name, mesh] : objects_of(options.folder)) {
    if (!options.only.empty() && std::ranges::count(options.only, name) == 0) continue;
    try {
      pipeline::Run run;
      stages::RemeshParams remesh;
      remesh.edge_length_m = 0.005;
      const auto even = stages::remesh(remesh, run, mesh);
      StudyObject object{name, mesh, stages::field({}, run, mesh), {}};
      for (int seed = 0; seed < options.seeds; ++seed) {
        const auto noisy = geometry::with_vertex_noise(
            even, options.noise_m, geometry::NoiseDirection::normal, static_cast<std::uint64_t>(seed));
        std::ranges::move(grasps_of(noisy, options, hand, name).grasps,
                          std::back_inserter(object.grasps.grasps));
      }
      std::fprintf(stderr, "%s: %zu grasps\n", name.c_str(), object.grasps.grasps.size());
      if (!object.grasps.grasps.empty()) all.push_back(std::move(object));
    } catch (const pipeline::UserError& error) {
      std::fprintf(stderr, "%s is left out: %s\n", name.c_str(), error.what());
    }
  }
  return all;
}

}  // namespace geocage::bench
