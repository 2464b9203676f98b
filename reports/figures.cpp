#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "reports/html.h"
#include "reports/pair_page.h"
#include "reports/scenes.h"

namespace geocage::reports {

namespace fs = std::filesystem;

namespace {

const char* const nan_label = "no dominant axis";

bool any_nan(const std::vector<double>& values) {
  return std::ranges::any_of(values, [](double x) { return std::isnan(x); });
}

std::string floor_note(const Studio& studio) {
  return fmt::format(" Squares of the floor: {:g} cm.", 100 * studio.grid_m());
}

/// One picture, seen from where its parts hide each other least.
class Draughtsman {
 public:
  Draughtsman(const PairResults& pair, const fs::path& folder, std::string prefix, bool frugal)
      : up_(pair.up_O()), folder_(folder), prefix_(std::move(prefix)), frugal_(frugal) {}

  Figure draw(const std::string& name, std::vector<Part> parts, std::string title, std::string caption,
              const std::string& legend = "") const {
    const Studio studio(std::move(parts));
    const std::string file = prefix_ + "-" + name + ".png";
    const View view = clearest_view(studio, up_);
    if (frugal_)
      write_indexed_png(folder_ / file, studio.picture(view, {.width = 480, .height = 360}));
    else
      write_png(folder_ / file, studio.picture(view));
    return {file, std::move(title), std::move(caption) + floor_note(studio) + legend};
  }

 private:
  geometry::Vec3 up_;
  const fs::path& folder_;
  std::string prefix_;
  bool frugal_;
};

Figure cloud_figure(const geometry::PointCloud& cloud, double object_m, const Draughtsman& draughtsman) {
  std::vector<Colour> colours;
  const std::size_t views = std::max<std::size_t>(1, cloud.sensor_origins.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const int view = cloud.view.empty() ? 0 : cloud.view[i];
    colours.push_back(oklch(0.72, 0.12, 230 + 360.0 * view / static_cast<double>(views)));
  }
  // A bit less than the mean gap between so many points on a ball as large as the object.
  const double gap_m =
      object_m * std::sqrt(std::numbers::pi / static_cast<double>(std::max<std::size_t>(1, cloud.size())));
  return draughtsman.draw(
      "scan", {point_part(cloud.points, cloud.normals, 0.8 * gap_m, colours)}, "What the sensor saw",
      fmt::format("{} points{}.", cloud.size(),
                  views == 1 ? " from one view" : fmt::format(" from {} views, a colour each", views)));
}

/// Where the best candidates of a heuristic are, a little above the surface.
std::vector<geometry::Vec3> best_candidates(const topology::Scores& scores, const std::string& heuristic,
                                            double lift_m) {
  std::vector<geometry::Vec3> places;
  for (const auto& candidate : scores.candidates)
    if (candidate.heuristic == heuristic && places.size() < 5)
      places.push_back(candidate.p_O + lift_m * candidate.n_O);
  return places;
}

Figure score_figure(const topology::Scores& scores, const std::string& heuristic,
                    const std::vector<double>& values, const Scale& scale, const std::string& title,
                    const std::string& meaning, const Draughtsman& draughtsman) {
  const double ball_m = 0.012 * geometry::check_mesh(scores.mesh).diagonal_m();
  std::vector<Part> parts = {coloured_surface(scores.mesh, values, scale)};
  const auto places = best_candidates(scores, heuristic, 0.5 * ball_m);
  if (!places.empty()) parts.push_back(ball_part(places, ball_m, Colour::Ones()));
  const std::string marks = places.empty() ? "" : " White balls: the best places to grasp by this score.";
  return draughtsman.draw(heuristic, std::move(parts), title, meaning + marks,
                          legend(scale, "", &degrees, any_nan(values) ? nan_label : ""));
}

Figure grasp_figure(const PairResults& pair, const hands::Hand& hand, int index,
                    const Draughtsman& draughtsman) {
  const hands::Grasp& grasp = pair.grasps->grasps[index];
  const auto q = hands::joint_vector(hand.tree, grasp.joints_rad, pair.input.grasps.string());
  const auto& values = pair.scores->ball.winding_angle_rad;
  std::string caption = fmt::format("Grasp {}", index + 1);
  if (pair.evaluations)
    for (const auto& result : pair.evaluations->grasps)
      if (result.grasp == index) caption += ", " + escaped(result.outcome) + " in the test";
  caption += ": the hand as it closed at the reconstructed surface, in the colours of the winding angle.";
  return draughtsman.draw(
      "grasp",
      {coloured_surface(pair.scores->mesh, values, sequential_scale(values)), hand_part(hand, grasp.X_OH, q)},
      "The best grasp", caption);
}

}  // namespace

std::vector<Figure> draw_pair(const PairResults& pair, const std::vector<hands::Hand>& hands,
                              const fs::path& folder, const std::string& prefix, bool frugal) {
  std::vector<Figure> figures;
  const Draughtsman draughtsman(pair, folder, prefix, frugal);
  if (!pair.scores) return figures;
  const auto& ball = pair.scores->ball;
  if (pair.cloud && pair.cloud->size() > 0)
    figures.push_back(
        cloud_figure(*pair.cloud, geometry::check_mesh(pair.scores->mesh).diagonal_m(), draughtsman));
  figures.push_back(score_figure(*pair.scores, "winding", ball.winding_angle_rad,
                                 sequential_scale(ball.winding_angle_rad), "Winding angle",
                                 "How far fingers can reach round the surface at each place.", draughtsman));
  figures.push_back(score_figure(
      *pair.scores, "curvature", ball.curvature_sum_rad, diverging_scale(ball.curvature_sum_rad, 0),
      "Total curvature",
      "Red: knobs and rims, that a hand can cap. Blue: saddles and forks. Pale: flat or tube.", draughtsman));
  const auto hand = std::ranges::find(hands, pair.input.hand, &hands::Hand::name);
  if (const auto best = pair.best_grasp(); best && hand != hands.end())
    figures.push_back(grasp_figure(pair, *hand, *best, draughtsman));
  return figures;
}

}  // namespace geocage::reports
