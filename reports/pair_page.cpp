#include "reports/pair_page.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "reports/html.h"

namespace geocage::reports {

namespace {

using Row = std::vector<std::string>;

template <class T>
std::optional<T> loaded(const std::filesystem::path& folder) {
  if (folder.empty()) return {};
  T value;
  load_artefact(value, folder);
  return value;
}

std::string badge(const std::string& outcome) {
  return element("span", escaped(outcome), "class=\"badge " + plain_name(outcome) + "\"");
}

std::string figure_html(const Figure& figure) {
  return element("figure",
                 fmt::format("<img src=\"pictures/{}\" alt=\"{}\" width=\"640\" height=\"480\">"
                             "<figcaption><b>{}</b>{}</figcaption>",
                             figure.file, escaped(figure.title), escaped(figure.title), figure.caption));
}

/// One coloured cell a push, with its figures where the pointer rests.
std::string pushes(const EvaluationResult& result) {
  std::string cells;
  for (const auto& push : result.directions)
    cells += element("span", escaped(push.name),
                     fmt::format("class=\"push {}\" title=\"{}: moved {}, turned {}\"",
                                 push.held ? "held" : "lost", push.held ? "held" : "not held",
                                 millimetres(push.max_displacement_m), degrees(push.max_rotation_rad)));
  return element("span", cells, "class=\"pushes\"");
}

std::string approach_text(const Approach& way) {
  if (way.outcome != "planned") return escaped(way.outcome);
  return fmt::format("{}, {} free{}", seconds(way.seconds), millimetres(way.min_clearance_m),
                     way.certified ? ", certified" : "");
}

/// The scores that a reader compares, where a grasp has them; its file holds all.
constexpr std::pair<const char*, const char*> shown_scores[] = {{"winding_angle_rad", "winding angle [rad]"},
                                                                {"curvature_sum_rad", "curvature [rad]"},
                                                                {"blocked_share", "blocked"},
                                                                {"closure_margin", "margin"},
                                                                {"contacts", "contacts"}};

std::string score_text(const hands::Grasp& grasp, const char* name) {
  const auto score = grasp.scores.find(name);
  return score == grasp.scores.end() || std::isnan(score->second) ? "–"
                                                                  : fmt::format("{:.3g}", score->second);
}

std::string grasp_table(const PairResults& pair) {
  Row head = {"grasp", "chosen by"};
  for (const auto& [name, title] : shown_scores) head.push_back(title);
  for (const char* name : {"way to it", "pushes", "drift", "outcome", "why"}) head.push_back(name);
  std::vector<Row> rows = {head};
  for (std::size_t i = 0; i < pair.grasps->grasps.size(); ++i) {
    const auto& grasp = pair.grasps->grasps[i];
    Row row = {std::to_string(i + 1), grasp.heuristic.empty() ? "–" : escaped(grasp.heuristic)};
    for (const auto& [name, title] : shown_scores) row.push_back(score_text(grasp, name));
    row.push_back(i < pair.approaches.size() ? approach_text(pair.approaches[i]) : "–");
    const EvaluationResult* result = nullptr;
    if (pair.evaluations)
      for (const auto& one : pair.evaluations->grasps)
        if (one.grasp == static_cast<int>(i)) result = &one;
    for (const auto& cell : result ? Row{pushes(*result), millimetres(result->drift_m),
                                         badge(result->outcome), escaped(result->reason)}
                                   : Row{"–", "–", "not tested", ""})
      row.push_back(cell);
    rows.push_back(row);
  }
  return element("h3", "Grasps, best score first") + table(rows, "class=\"text\"");
}

std::string controls(const std::vector<ControlResult>& all) {
  if (all.empty()) return element("p", "No controls were run: nobody knows whether this test can fail.");
  std::vector<Row> rows = {{"control", "grasps", "trials held", "grasps held in all", "rule", ""}};
  bool valid = true;
  for (const ControlResult& control : all) {
    valid = valid && control.ok;
    rows.push_back({escaped(control.name), std::to_string(control.grasps),
                    fmt::format("{} of {}", control.held, control.trials), std::to_string(control.passed),
                    escaped(control.rule), control.ok ? "as it must be" : "<b>failed</b>"});
  }
  std::string list = table(rows, "class=\"text\"");
  if (valid) return list;
  return element("p", "<b>This test is not valid:</b> a control that must fail did not.",
                 "class=\"warning\"") +
         list;
}

std::string test_result(const PairResults& pair) {
  const Evaluations& test = *pair.evaluations;
  const Proportion rate = pair.held_rate();
  std::string outcomes;
  for (const auto& [outcome, count] : test.counts)
    outcomes += fmt::format("{}{} {}", outcomes.empty() ? "" : ", ", count, escaped(outcome));
  std::string html = element("h3", fmt::format("Test <code>{}</code>", escaped(test.protocol)));
  html += element("p", fmt::format("Held: <b>{} of {}</b>{}{} (95 % interval {} to {}), {} within 2 cm. "
                                   "Outcomes: {}. Simulated with {}.",
                                   test.held(), test.grasps.size(), interval_bar(rate), percent(rate.share),
                                   percent(rate.low), percent(rate.high), test.held_within_2_cm(), outcomes,
                                   test.object_geometry == "truth" ? "the true surface"
                                                                   : "the surface rebuilt from the scan"));
  return html + controls(test.controls);
}

std::string cage_table(const Cages& cages) {
  std::vector<Row> rows = {
      {"grasp", "pulls kept", "ring kept", "wrenches kept", "a50 [weights]", "way out", "outcome", "why"}};
  for (const CageResult& cage : cages.grasps)
    rows.push_back({std::to_string(cage.grasp + 1), fmt::format("{} of {}", cage.pulls_retained, cage.pulls),
                    fmt::format("{} of {}", cage.ring_retained, cage.ring),
                    fmt::format("{} of {}", cage.wrenches - cage.wrenches_lost, cage.wrenches),
                    cage.half.empty() ? "–" : escaped(cage.half), escaped(cage.search), badge(cage.outcome),
                    escaped(cage.reason)});
  return element("h3", "Cage test: fingers locked, no friction") +
         element("p",
                 "A way out that was not found is no proof of a cage. “Ring” is gravity across the closing "
                 "axis, with that axis locked. a50 is the amplitude of random wrenches at which half are "
                 "kept for 10 "
                 "s.") +
         table(rows, "class=\"text\"") + controls(cages.controls);
}

std::string rejected_poses(const hands::GraspSet& grasps) {
  if (grasps.rejected.empty()) return "";
  int sum = 0;
  std::vector<Row> rows = {{"rule", "poses turned down"}};
  for (const auto& [rule, count] : grasps.rejected) {
    rows.push_back({escaped(rule), std::to_string(count)});
    sum += count;
  }
  return fold(fmt::format("{} poses were turned down before any test", sum), table(rows));
}

std::string missing(const PairResults& pair) {
  const std::vector<std::pair<const char*, bool>> parts = {{"the scores", pair.scores.has_value()},
                                                           {"the grasps", pair.grasps.has_value()},
                                                           {"the test", pair.evaluations.has_value()}};
  for (const auto& [name, there] : parts)
    if (!there) return element("p", fmt::format("It ended before {}.", name), "class=\"soft\"");
  return "";
}

}  // namespace

Proportion PairResults::held_rate() const {
  return evaluations ? wilson(evaluations->held(), static_cast<int>(evaluations->grasps.size()))
                     : Proportion{};
}

std::optional<int> PairResults::best_grasp() const {
  if (!grasps || grasps->grasps.empty()) return {};
  if (evaluations)
    for (const auto& result : evaluations->grasps)
      if (result.outcome == "held") return result.grasp;
  return 0;
}

geometry::Vec3 PairResults::up_O() const {
  return cloud && cloud->support ? cloud->support->normal : input.up_O;
}

PairResults load_pair(const PairInput& input) {
  PairResults pair;
  pair.input = input;
  pair.cloud = loaded<geometry::PointCloud>(input.cloud);
  pair.scores = loaded<topology::Scores>(input.scores);
  pair.grasps = loaded<hands::GraspSet>(input.grasps);
  if (!input.evaluations.empty()) pair.evaluations = read_evaluations(input.evaluations);
  if (!input.cages.empty()) pair.cages = read_cages(input.cages);
  if (!input.trajectories.empty()) pair.approaches = read_approaches(input.trajectories);
  return pair;
}

std::string pair_section(const PairResults& pair, const std::vector<Figure>& figures, const std::string& id) {
  const PairInput& input = pair.input;
  std::string html =
      element("h2", fmt::format("{} <span class=\"soft\">with</span> {} {}", escaped(input.object),
                                escaped(input.hand), badge(input.outcome)));
  html += element(
      "p",
      fmt::format("{}. {}", escaped(input.source),
                  input.truth_known ? "The file is the true surface; it was scanned by a virtual camera, "
                                      "and the grasps know the scan alone."
                                    : "The file is a scan; nobody knows the true surface."),
      "class=\"soft\"");
  if (!input.sentence.empty()) html += element("p", escaped(input.sentence), "class=\"warning\"");
  std::string pictures;
  for (const Figure& figure : figures) pictures += figure_html(figure);
  if (!pictures.empty()) html += element("div", pictures, "class=\"figures\"");
  if (pair.evaluations) html += test_result(pair);
  if (pair.cages) html += cage_table(*pair.cages);
  if (pair.grasps && !pair.grasps->grasps.empty()) html += grasp_table(pair);
  if (pair.grasps) html += rejected_poses(*pair.grasps);
  if (input.outcome != "skipped") html += missing(pair);
  return element("section", html, "id=\"" + id + "\"");
}

}  // namespace geocage::reports
