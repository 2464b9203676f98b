#include "cli/results_table.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <map>
#include <set>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "hands/grasp.h"
#include "pipeline/text_file.h"
#include "reports/bootstrap.h"
#include "reports/results.h"
#include "reports/statistics.h"

namespace geocage::cli {

namespace fs = std::filesystem;
using pipeline::SlotResult;

namespace {

using Row = std::map<std::string, Cell>;  ///< by column

Cell number(double x) {
  return std::isfinite(x) ? Cell(x) : Cell();
}

/// Metrics of `agreement`; columns with "agreement_" before them.
constexpr const char* agreement_measures[] = {
    "winding_rank_correlation",   "winding_top_overlap",   "winding_drift_m",   "winding_drift_radii",
    "curvature_rank_correlation", "curvature_top_overlap", "curvature_drift_m", "curvature_drift_radii"};

bool compares_scores(const Flow& flow) {
  return std::ranges::any_of(flow.pairs, [](const FlowPair& pair) { return !pair.agreement_slot.empty(); });
}

/// A level as a number where it is one.
Cell level_cell(const std::string& text) {
  double x = 0;
  const char* const end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, x);
  return error == std::errc() && rest == end ? Cell(x) : Cell(text);
}

/// The stage that a pair was lost at: its own first slot that has no value.
std::string lost_at(const FlowPair& pair, const std::map<std::string, const SlotResult*>& slots) {
  for (const auto& name : pair.slots) {
    const auto it = slots.find(name);
    if (it != slots.end() && it->second->state == pipeline::SlotState::failed) return it->second->stage;
  }
  return "";
}

/// Whether the run was to test it; `--until place` tests nothing.
bool tested(const FlowPair& pair, const std::map<std::string, const SlotResult*>& slots) {
  return pair.evaluate_slot.empty() || slots.contains(pair.evaluate_slot);
}

/// Whether score found no place for a hand.
bool without_candidates(const SlotResult* score) {
  double candidates = 0;
  if (score)
    for (const auto& [name, value] : score->metrics)
      if (name.ends_with("_candidates") && !name.ends_with("_far_candidates")) candidates += value;
  return score && candidates == 0;
}

/// Columns of a grasp: its scores and what became of it.
void describe_grasp(const hands::Grasp& grasp, Row& row) {
  row["heuristic"] = grasp.heuristic;
  row["force_closure"] = grasp.force_closure;
  for (const auto& [name, value] : grasp.scores) row["score_" + name] = number(value);
}

void describe_approach(const reports::Approach& way, Row& row) {
  row["approach_outcome"] = way.outcome;
  row["approach_s"] = number(way.seconds);
  row["min_clearance_m"] = number(way.min_clearance_m);
  row["certified"] = way.certified ? 1.0 : 0.0;
}

void describe_evaluation(const reports::Evaluations& all, const reports::EvaluationResult& result, Row& row) {
  row["protocol"] = all.protocol;
  row["object_geometry"] = all.object_geometry;
  row["outcome"] = result.outcome;
  row["reason"] = result.reason;
  row["held"] = result.outcome == "held" ? 1.0 : 0.0;
  row["drift_m"] = number(result.drift_m);
  row["drift_rad"] = number(result.drift_rad);
  row["directions"] = static_cast<double>(result.directions.size());
  row["directions_held"] =
      static_cast<double>(std::ranges::count(result.directions, true, &reports::DirectionResult::held));
  row["directions_held_2_cm"] = static_cast<double>(
      std::ranges::count(result.directions, true, &reports::DirectionResult::held_within_2_cm));
  row["held_2_cm"] = result.held_within_2_cm ? 1.0 : 0.0;
  if (!result.worst.empty()) row["worst_direction"] = result.worst;
  if (result.fall_s) row["fall_s"] = *result.fall_s;
  if (result.lift) {
    row["lift_outcome"] = result.lift->outcome;
    row["lift_phase"] = result.lift->phase;
    row["lift_released"] = result.lift->released ? 1.0 : 0.0;
  }
  row["valid"] = all.valid() ? 1.0 : 0.0;
}

void describe_cage(const reports::Cages& all, const reports::CageResult& cage, Row& row) {
  row["cage_valid"] = all.valid() ? 1.0 : 0.0;
  row["cage_outcome"] = cage.outcome;
  row["cage_pulls_retained"] = static_cast<double>(cage.pulls_retained);
  row["cage_ring_retained"] = static_cast<double>(cage.ring_retained);
  row["cage_wrenches"] = static_cast<double>(cage.wrenches);
  row["cage_wrenches_lost"] = static_cast<double>(cage.wrenches_lost);
  row["cage_escape_search"] = cage.search;
  row["cage_searches_found"] = static_cast<double>(cage.searches_found);
  if (cage.rise_m) row["cage_rise_m"] = *cage.rise_m;
  if (cage.compliant > 0) row["cage_compliant_retained"] = static_cast<double>(cage.compliant_retained);
  if (cage.half_weights) row["cage_a50_weights"] = *cage.half_weights;
  if (!cage.half_weights && !cage.half.empty()) row["cage_a50_censored"] = cage.half;
  for (const auto& one : cage.amplitudes) {
    row[fmt::format("cage_survival_{:g}", one.weights)] = number(one.survival);
    row[fmt::format("cage_mean_held_s_{:g}", one.weights)] = number(one.mean_held_s);
  }
}

/// The rows of one pair.
class PairRows {
 public:
  PairRows(const FlowPair& pair, const PairResult& result,
           const std::map<std::string, const SlotResult*>& slots)
      : pair_(pair), slots_(slots) {
    common_["object"] = pair.base;
    common_["hand"] = pair.hand;
    common_["variant"] = pair.object.substr(pair.base.size());
    common_["pair_outcome"] = std::string(word(result.outcome));
    common_["lost_at"] = stage_of_loss(result.outcome);
    common_["sentence"] = result.sentence;
    if (tested(pair, slots)) common_["held"] = common_["held_2_cm"] = 0.0;
    for (const auto& [name, value] : pair.levels) common_[name] = level_cell(value);
    const auto agreement = slots.find(pair.agreement_slot);
    if (agreement == slots.end()) return;
    for (const char* name : agreement_measures)
      if (const auto it = agreement->second->metrics.find(name); it != agreement->second->metrics.end())
        common_[std::string("agreement_") + name] = number(it->second);
  }

  /// Every row says at which stage the pair's best grasp was lost.
  std::vector<Row> rows() const {
    std::vector<Row> all = grasp_rows();
    std::string lost = text_of(all.front().at("lost_at"));
    const auto is = [&](const char* column, const char* word) {
      return text_of(all.front()[column]) == word;
    };
    if (lost.empty() && tested(pair_, slots_) && !is("outcome", "held"))
      lost = is("approach_outcome", "planned") ? "evaluate" : "approach";
    for (Row& row : all) row["best_lost_at"] = lost;
    return all;
  }

 private:
  static std::string text_of(const Cell& cell) {
    const auto* text = std::get_if<std::string>(&cell);
    return text ? *text : "";
  }

  std::string stage_of_loss(PairOutcome outcome) const {
    if (outcome == PairOutcome::skipped) return "skipped";
    if (outcome != PairOutcome::rejected) return lost_at(pair_, slots_);
    const auto score = slots_.find(pair_.score_slot);
    return without_candidates(score == slots_.end() ? nullptr : score->second) ? "score" : "place";
  }

  std::vector<Row> grasp_rows() const {
    const fs::path place = folder_of(pair_.place_slot);
    if (place.empty()) return {common_};
    const auto set = hands::read_grasps(place / "grasps.json");
    const fs::path approach = folder_of(pair_.approach_slot), evaluate = folder_of(pair_.evaluate_slot);
    const auto ways =
        approach.empty() ? std::vector<reports::Approach>{} : reports::read_approaches(approach);
    const auto tests = evaluate.empty() ? reports::Evaluations{} : reports::read_evaluations(evaluate);
    const fs::path cage = folder_of(pair_.cage_slot);
    const auto cages = cage.empty() ? reports::Cages{} : reports::read_cages(cage);
    std::vector<Row> rows;
    for (std::size_t i = 0; i < set.grasps.size(); ++i) {
      Row& row = rows.emplace_back(common_);
      row["grasp"] = static_cast<double>(i);
      describe_grasp(set.grasps[i], row);
      if (i < ways.size()) describe_approach(ways[i], row);
      for (const auto& test : tests.grasps)
        if (test.grasp == static_cast<int>(i)) describe_evaluation(tests, test, row);
      for (const auto& one : cages.grasps)
        if (one.grasp == static_cast<int>(i)) describe_cage(cages, one, row);
    }
    return rows.empty() ? std::vector<Row>{common_} : rows;
  }

  fs::path folder_of(const std::string& slot) const {
    const auto it = slots_.find(slot);
    return it == slots_.end() ? fs::path() : it->second->folder;
  }
  const FlowPair& pair_;
  const std::map<std::string, const SlotResult*>& slots_;
  Row common_;
};

bool is_seed(const std::string& name) {
  return name.ends_with(".seed");
}

/// Rows of the table of grasps by names of columns.
class Reader {
 public:
  explicit Reader(const Table& table) {
    for (std::size_t i = 0; i < table.columns.size(); ++i) place_[table.columns[i]] = i;
  }
  const Cell& cell(const std::vector<Cell>& row, const std::string& name) const {
    return row[place_.at(name)];
  }
  /// False where nothing was tested.
  bool tested(const std::vector<Cell>& row) const {
    return std::holds_alternative<double>(cell(row, "held"));
  }
  double held(const std::vector<Cell>& row) const { return std::get<double>(cell(row, "held")); }
  double held_2_cm(const std::vector<Cell>& row) const { return std::get<double>(cell(row, "held_2_cm")); }
  /// The pair's best grasp, or the row that says that it has none.
  bool best(const std::vector<Cell>& row) const {
    const auto* grasp = std::get_if<double>(&cell(row, "grasp"));
    return !grasp || *grasp == 0;
  }
  std::vector<Cell> cells(const std::vector<Cell>& row, const std::vector<std::string>& names) const {
    std::vector<Cell> found;
    found.reserve(names.size());
    for (const auto& name : names) found.push_back(cell(row, name));
    return found;
  }

 private:
  std::map<std::string, std::size_t> place_;
};

using ByObject = std::map<Cell, std::vector<double>>;
std::vector<std::vector<double>> groups_of(const ByObject& objects) {
  std::vector<std::vector<double>> groups;
  for (const auto& [object, values] : objects) groups.push_back(values);
  return groups;
}

std::vector<std::string> settings_of(const Flow& flow) {
  std::vector<std::string> names;
  for (const auto& name : flow.swept)
    if (!is_seed(name)) names.push_back(name);
  return names;
}

/// Columns that some row has, whose names start with either.
std::set<std::string> columns_of(const std::vector<Row>& rows, std::string_view start,
                                 std::string_view other) {
  std::set<std::string> names;
  for (const auto& row : rows)
    for (const auto& [name, value] : row)
      if (name.starts_with(start) || name.starts_with(other)) names.insert(name);
  return names;
}

}  // namespace

Table grasp_table(const Flow& flow, const RunSummary& summary) {
  std::map<std::string, const SlotResult*> slots;
  for (const auto& slot : summary.slots) slots[slot.slot] = &slot;
  std::vector<Row> rows;
  for (std::size_t i = 0; i < flow.pairs.size(); ++i)
    for (Row& row : PairRows(flow.pairs[i], summary.pairs[i], slots).rows()) rows.push_back(std::move(row));

  Table table{"grasps", {"object", "hand", "variant"}, {}};
  table.columns.insert(table.columns.end(), flow.swept.begin(), flow.swept.end());
  if (compares_scores(flow))
    for (const char* name : agreement_measures) table.columns.push_back(std::string("agreement_") + name);
  for (const char* name :
       {"pair_outcome", "lost_at", "best_lost_at", "sentence", "grasp", "heuristic", "force_closure"})
    table.columns.emplace_back(name);
  const auto scores = columns_of(rows, "score_", "score_");
  table.columns.insert(table.columns.end(), scores.begin(), scores.end());
  for (const char* name : {"approach_outcome",
                           "approach_s",
                           "min_clearance_m",
                           "certified",
                           "protocol",
                           "object_geometry",
                           "outcome",
                           "reason",
                           "held",
                           "held_2_cm",
                           "drift_m",
                           "drift_rad",
                           "directions",
                           "directions_held",
                           "directions_held_2_cm",
                           "worst_direction",
                           "fall_s",
                           "lift_outcome",
                           "lift_phase",
                           "lift_released",
                           "valid",
                           "cage_outcome",
                           "cage_pulls_retained",
                           "cage_ring_retained",
                           "cage_wrenches",
                           "cage_wrenches_lost",
                           "cage_escape_search",
                           "cage_searches_found",
                           "cage_rise_m",
                           "cage_compliant_retained",
                           "cage_a50_weights",
                           "cage_a50_censored",
                           "cage_valid"})
    table.columns.emplace_back(name);
  const auto amplitudes = columns_of(rows, "cage_survival_", "cage_mean_held_s_");
  table.columns.insert(table.columns.end(), amplitudes.begin(), amplitudes.end());
  for (Row& row : rows) {
    auto& cells = table.rows.emplace_back();
    for (const auto& name : table.columns) cells.push_back(row[name]);
  }
  return table;
}

Table rate_table(const Flow& flow, const Table& grasps) {
  const Reader read(grasps);
  auto keys = settings_of(flow);
  keys.insert(keys.begin(), "hand");
  std::map<std::pair<std::string, std::vector<Cell>>, ByObject> cases;
  for (const auto& row : grasps.rows) {
    if (!read.tested(row)) continue;
    const auto key = read.cells(row, keys);
    cases[{"grasp held", key}][read.cell(row, "object")].push_back(read.held(row));
    cases[{"grasp held within 2 cm", key}][read.cell(row, "object")].push_back(read.held_2_cm(row));
    if (read.best(row)) cases[{"best grasp held", key}][read.cell(row, "object")].push_back(read.held(row));
  }
  Table table{"rates", {"measure"}, {}};
  table.columns.insert(table.columns.end(), keys.begin(), keys.end());
  for (const char* name :
       {"objects", "trials", "held", "rate", "wilson_low", "wilson_high", "bootstrap_low", "bootstrap_high"})
    table.columns.emplace_back(name);
  for (const auto& [key, objects] : cases) {
    int trials = 0, held = 0;
    for (const auto& [object, values] : objects)
      for (double x : values) {
        ++trials;
        held += x > 0;
      }
    const auto wilson = reports::wilson(held, trials);
    const auto bootstrap = reports::bootstrap_over_groups(groups_of(objects));
    auto& row = table.rows.emplace_back();
    row.emplace_back(key.first);
    row.insert(row.end(), key.second.begin(), key.second.end());
    for (double x : {double(objects.size()), double(trials), double(held), wilson.share, wilson.low,
                     wilson.high, bootstrap.low, bootstrap.high})
      row.push_back(number(x));
  }
  return table;
}

Table paired_table(const Flow& flow, const Table& grasps) {
  Table table{"paired",
              {"setting", "first", "other", "hand", "objects", "pairs", "gained", "lost", "mcnemar_p",
               "mean_difference", "bootstrap_low", "bootstrap_high"},
              {}};
  const Reader read(grasps);
  for (const auto& setting : settings_of(flow)) {
    std::vector<std::string> keys = {"object", "hand"};
    for (const auto& name : flow.swept)
      if (name != setting) keys.push_back(name);
    std::vector<Cell> levels;  // in the flow's order
    std::map<std::vector<Cell>, std::map<Cell, double>> trials;
    for (const auto& row : grasps.rows) {
      if (!read.best(row) || !read.tested(row)) continue;
      const Cell& level = read.cell(row, setting);
      if (std::ranges::find(levels, level) == levels.end()) levels.push_back(level);
      trials[read.cells(row, keys)][level] = read.held(row);
    }
    for (std::size_t k = 1; k < levels.size(); ++k) {
      std::map<Cell, ByObject> hands;
      for (const auto& [key, held] : trials)
        if (held.contains(levels[0]) && held.contains(levels[k]))
          hands[key[1]][key[0]].push_back(held.at(levels[k]) - held.at(levels[0]));
      for (const auto& [hand, objects] : hands) {
        double pairs = 0, gained = 0, lost = 0;
        for (const auto& [object, values] : objects)
          for (double x : values) {
            ++pairs;
            gained += x > 0;
            lost += x < 0;
          }
        const auto mean = reports::bootstrap_over_groups(groups_of(objects));
        table.rows.push_back({setting, levels[0], levels[k], hand, double(objects.size()), pairs, gained,
                              lost, reports::mcnemar(static_cast<int>(gained), static_cast<int>(lost)),
                              mean.mean, number(mean.low), number(mean.high)});
      }
    }
  }
  return table;
}

Table loss_table(const Flow& flow, const Table& grasps) {
  const Reader read(grasps);
  auto keys = settings_of(flow);
  keys.insert(keys.begin(), "hand");
  keys.emplace_back("best_lost_at");
  std::map<std::vector<Cell>, double> pairs;
  for (const auto& row : grasps.rows)
    if (read.best(row) && read.tested(row)) ++pairs[read.cells(row, keys)];
  keys.emplace_back("pairs");
  Table table{"losses", keys, {}};
  for (const auto& [key, count] : pairs) {
    table.rows.push_back(key);
    table.rows.back().emplace_back(count);
  }
  return table;
}

Table agreement_table(const Flow& flow, const Table& grasps) {
  auto keys = settings_of(flow);
  keys.insert(keys.begin(), "hand");
  Table table{"agreement", {"measure"}, {}};
  table.columns.insert(table.columns.end(), keys.begin(), keys.end());
  for (const char* name : {"objects", "pairs", "mean", "bootstrap_low", "bootstrap_high"})
    table.columns.emplace_back(name);
  if (!compares_scores(flow)) return table;
  const Reader read(grasps);
  for (const char* measure : agreement_measures) {
    std::map<std::vector<Cell>, ByObject> cases;
    for (const auto& row : grasps.rows)
      if (const auto* value = std::get_if<double>(&read.cell(row, std::string("agreement_") + measure));
          value && read.best(row))
        cases[read.cells(row, keys)][read.cell(row, "object")].push_back(*value);
    for (const auto& [key, objects] : cases) {
      std::size_t pairs = 0;
      for (const auto& [object, values] : objects) pairs += values.size();
      const auto mean = reports::bootstrap_over_groups(groups_of(objects));
      auto& row = table.rows.emplace_back();
      row.emplace_back(measure);
      row.insert(row.end(), key.begin(), key.end());
      for (double x : {double(objects.size()), double(pairs), mean.mean, mean.low, mean.high})
        row.push_back(number(x));
    }
  }
  return table;
}

Table slot_table(const RunSummary& summary) {
  Table table{"slots", {"slot", "stage", "state", "code", "sentence", "made_s", "peak_memory_gib"}, {}};
  for (const auto& slot : summary.slots)
    table.rows.push_back({slot.slot, slot.stage, std::string(pipeline::word(slot.state)), slot.code,
                          slot.sentence, number(slot.made_seconds), number(slot.peak_memory_gib)});
  return table;
}

namespace {

nlohmann::json to_json(const Cell& cell) {
  if (const auto* x = std::get_if<double>(&cell)) return *x;
  if (const auto* text = std::get_if<std::string>(&cell)) return *text;
  return nullptr;
}

/// The small tables, for whoever draws curves.
void write_summary(const Flow& flow, const std::vector<Table>& tables, const fs::path& file) {
  nlohmann::ordered_json json = {{"schema", "geocage-results 1"}, {"flow", flow.name}, {"swept", flow.swept}};
  for (const Table& table : tables) {
    auto rows = nlohmann::json::array();
    for (const auto& row : table.rows) {
      auto& cells = rows.emplace_back(nlohmann::json::array());
      for (const Cell& cell : row) cells.push_back(to_json(cell));
    }
    json["tables"][table.name] = {{"columns", table.columns}, {"rows", rows}};
  }
  pipeline::replace_text(file, json.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
}

}  // namespace

fs::path write_results(const Flow& flow, const RunSummary& summary, const fs::path& folder) {
  const Table grasps = grasp_table(flow, summary);
  fs::path csv = folder / "results.csv";
  fs::create_directories(folder);
  pipeline::replace_text(csv, csv_text(grasps));
  std::vector<Table> tables = {rate_table(flow, grasps), paired_table(flow, grasps), loss_table(flow, grasps),
                               agreement_table(flow, grasps)};
  write_summary(flow, tables, folder / "results.json");
  tables.push_back(grasps);
  tables.push_back(slot_table(summary));
  write_database(tables, folder / "results.sqlite");
  return csv;
}

}  // namespace geocage::cli
