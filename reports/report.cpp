#include "reports/report.h"

#include <algorithm>
#include <set>

#include <fmt/format.h>

#include "pipeline/text_file.h"
#include "reports/html.h"
#include "reports/pair_page.h"
#include "reports/scene_page.h"
#include "reports/style.h"
#include "reports/viewer_files.h"

namespace geocage::reports {

namespace fs = std::filesystem;

namespace {

using Row = std::vector<std::string>;
constexpr std::size_t many_pairs = 12;  ///< from here on bytes count more than shades

std::string section(std::string_view title, std::string_view content) {
  return element("section", element("h2", title) + std::string(content));
}

std::string pair_id(std::size_t index) {
  return fmt::format("pair-{}", index + 1);
}

std::string header(const ReportInput& input) {
  const Counts& c = input.counts;
  std::string tiles;
  for (const auto& [name, count] : {std::pair{"pairs", c.in},
                                    {"done", c.done},
                                    {"failed", c.failed},
                                    {"rejected", c.rejected},
                                    {"skipped", c.skipped}})
    tiles += element("div", fmt::format("<b>{}</b>{}", count, name), "class=\"tile\"");
  const std::string sum = fmt::format("{} + {} + {} + {} = {}", c.done, c.failed, c.rejected, c.skipped,
                                      c.done + c.failed + c.rejected + c.skipped);
  return element("h1", escaped(input.title)) +
         element("p",
                 "Caging grasps from scans: what each object looked like to the sensor, where its surface "
                 "invites a "
                 "hand, how the hand closed there, and whether it kept the object when a simulator pushed.") +
         element("div", tiles, "class=\"tiles\"") +
         (c.add_up()
              ? element("p", fmt::format("The counts add up: {}, every object-hand pair once.", sum),
                        "class=\"soft\"")
              : element("p",
                        fmt::format("<b>The counts do not add up:</b> {}, but {} pairs went in. Please "
                                    "report this.",
                                    sum, c.in),
                        "class=\"warning\""));
}

std::string overview(const std::vector<PairResults>& pairs) {
  std::vector<Row> rows = {{"object", "hand", "outcome", "grasps", "held", "95 % interval", "controls"}};
  int held = 0, tested = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const PairResults& pair = pairs[i];
    Row row = {fmt::format("<a href=\"#{}\">{}</a>", pair_id(i), escaped(pair.input.object)),
               escaped(pair.input.hand), escaped(pair.input.outcome),
               pair.grasps ? std::to_string(pair.grasps->grasps.size()) : "–"};
    if (pair.evaluations) {
      const Evaluations& test = *pair.evaluations;
      const Proportion rate = pair.held_rate();
      held += test.held();
      tested += static_cast<int>(test.grasps.size());
      row.push_back(fmt::format("{} of {}", test.held(), test.grasps.size()));
      row.push_back(interval_bar(rate) + percent(rate.low) + " – " + percent(rate.high));
      row.push_back(test.controls.empty()                                    ? "none"
                    : std::ranges::all_of(test.controls, &ControlResult::ok) ? "as they must be"
                                                                             : "<b>failed: not valid</b>");
    } else {
      row.insert(row.end(), {"–", "–", "–"});
    }
    rows.push_back(row);
  }
  const Proportion rate = wilson(held, tested);
  const std::string all = fmt::format(
      "Of all {} grasps {} were held: {} (95 % interval {} to {}). The interval takes grasps as independent; "
      "those of "
      "one object are not, so the truth is less sure than it says.",
      tested, held, percent(rate.share), percent(rate.low), percent(rate.high));
  return section("At a glance", table(rows) + (tested > 0 ? element("p", all) : ""));
}

std::string meaning() {
  return section(
      "What these figures mean, and what they don’t",
      element(
          "p",
          "<b>Held</b> says: in a simulator, with this friction and these motors, the closing hand kept the "
          "object "
          "within the limits while it was pushed six ways. It is a test of force in one rigid-body engine. "
          "It does "
          "not prove a cage, says nothing of torques or other pushes, and is no promise for a real hand.") +
          element("p",
                  "<b>Lost</b> grasps are results, not faults of the run; they count in the rate, and so do "
                  "grasps that "
                  "were rejected, that never settled, or whose simulation failed. Rates of other projects "
                  "follow other "
                  "protocols and can’t be compared with these."));
}

std::string troubles(const ReportInput& input) {
  std::vector<Row> rows = {{"what", "state", "why"}};
  for (const PairInput& pair : input.pairs)
    if (pair.outcome != "done")
      rows.push_back(
          {escaped(pair.object + " with " + pair.hand), escaped(pair.outcome), escaped(pair.sentence)});
  for (const SlotInput& slot : input.slots)
    if (slot.state == "failed") rows.push_back({escaped(slot.slot), "failed", escaped(slot.sentence)});
  return rows.size() == 1 ? "" : section("Failed, rejected and skipped", table(rows, "class=\"text\""));
}

std::string times(const std::vector<SlotInput>& slots) {
  std::vector<TimeBar> bars;  // in the order of the first slot of each stage
  for (const SlotInput& slot : slots) {
    auto bar = std::ranges::find(bars, slot.stage, &TimeBar::name);
    if (bar == bars.end()) bar = bars.insert(bars.end(), {slot.stage, 0, 0});
    (slot.state == "hit" ? bar->earlier_s : bar->now_s) +=
        slot.state == "hit" ? slot.made_seconds : slot.seconds;
  }
  if (bars.empty()) return "";
  return section(
      "Where the time went",
      time_chart(bars) + element("p",
                                 "Seconds a stage, all slots together. Pale: spent in an earlier run; "
                                 "this one found the result in the store.",
                                 "class=\"soft\""));
}

std::string sources(const std::vector<PairInput>& pairs) {
  std::vector<Row> rows = {{"object", "from"}};
  std::set<std::string> seen;
  for (const PairInput& pair : pairs)
    if (seen.insert(pair.object).second) rows.push_back({escaped(pair.object), escaped(pair.source)});
  return section("Where the objects come from", table(rows, "class=\"text\""));
}

std::string parameter_rows(const std::vector<ParameterInput>& parameters) {
  std::vector<Row> rows = {{"name", "value", "set by"}};
  for (const auto& parameter : parameters)
    rows.push_back(
        {escaped(parameter.name), element("code", escaped(parameter.value)), escaped(parameter.from)});
  return table(rows, "class=\"text\"");
}

std::string text_rows(const Texts& texts) {
  std::vector<Row> rows = {{"name", "value"}};
  for (const auto& [name, value] : texts) rows.push_back({escaped(name), element("code", escaped(value))});
  return table(rows, "class=\"text\"");
}

std::string slot_table(const std::vector<SlotInput>& slots) {
  std::vector<Row> rows = {{"slot", "state", "seconds", "figures", "folder"}};
  for (const SlotInput& slot : slots) {
    std::string metrics;
    for (const auto& [name, value] : slot.figures())
      metrics += fmt::format("{} {:.4g}; ", escaped(name), value);
    if (metrics.ends_with("; ")) metrics.resize(metrics.size() - 2);
    rows.push_back({escaped(slot.slot), escaped(slot.state),
                    seconds(slot.state == "hit" ? slot.made_seconds : slot.seconds), metrics,
                    slot.folder.empty() ? "" : element("code", escaped(slot.folder.string()))});
  }
  return table(rows);
}

std::string details(const ReportInput& input, const std::vector<PairResults>& pairs) {
  std::string parameters, engines;
  for (const auto& [slot, list] : input.parameters) parameters += fold(escaped(slot), parameter_rows(list));
  std::set<std::string> told;
  for (const PairResults& pair : pairs)
    if (pair.evaluations)
      if (const auto rows = text_rows(pair.evaluations->engine); told.insert(rows).second)
        engines += element("h3", escaped(pair.input.object) + " with " + escaped(pair.input.hand)) + rows;
  std::string html = fold("Every slot", slot_table(input.slots));
  if (!parameters.empty()) html += fold("Parameters used", parameters);
  if (!engines.empty()) html += fold("Settings of the simulator", engines);
  if (!input.flow_text.empty()) html += fold("The flow", element("pre", escaped(input.flow_text)));
  return section("Details", html);
}

std::string footer(const Texts& run) {
  std::string html;
  for (const auto& [name, value] : run)
    html += (html.empty() ? "" : " · ") + escaped(name) + " " + escaped(value);
  return element("footer", html);
}

std::string no_viewer() {
  return element(
      "p",
      "This report has no 3-D views, no interactive plots and no table to filter and sort: their "
      "scripts were not built, because node, npm or the network was missing. Everything else is here.",
      "class=\"soft\"");
}

std::string page(const ReportInput& input, const std::vector<PairResults>& pairs,
                 const std::vector<std::vector<Figure>>& figures, const std::string& scenes, bool viewer) {
  std::string body = header(input) + (viewer ? "" : no_viewer()) + overview(pairs) + scenes;
  for (std::size_t i = 0; i < pairs.size(); ++i) body += pair_section(pairs[i], figures[i], pair_id(i));
  body += troubles(input) + meaning() + times(input.slots) + sources(input.pairs) + details(input, pairs) +
          footer(input.run);
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width, "
      "initial-scale=1\"><title>{}</title><style>{}</style></head><body><main>{}</main>"
      "</body></html>\n",
      escaped(input.title), style_sheet, body);
}

}  // namespace

std::map<std::string, double> SlotInput::figures() const {
  auto all = metrics;
  if (const auto trials = metrics.find("trials"); trials != metrics.end() && made_seconds > 0)
    all["trials_per_s"] = trials->second / made_seconds;
  return all;
}

fs::path write_report(const ReportInput& input, const fs::path& folder) {
  const fs::path pictures = folder / "pictures";
  fs::create_directories(pictures);
  std::vector<PairResults> pairs;
  std::vector<std::vector<Figure>> figures;
  for (std::size_t i = 0; i < input.pairs.size(); ++i) {
    pairs.push_back(load_pair(input.pairs[i]));
    const std::string prefix =
        fmt::format("{}-{}-{}", i + 1, plain_name(pairs[i].input.object), plain_name(pairs[i].input.hand));
    figures.push_back(input.pairs[i].drawn ? draw_pair(pairs[i], input.hands, pictures, prefix,
                                                       input.pairs.size() > many_pairs)
                                           : std::vector<Figure>{});
  }
  std::string scenes;
  for (std::size_t i = 0; i < input.scenes.size(); ++i)
    scenes += scene_section(input.scenes[i], pictures,
                            fmt::format("scene-{}-{}", i + 1, plain_name(input.scenes[i].name)));
  const bool viewer = viewer_is_built(input.viewer);
  fs::path index = folder / "index.html";
  pipeline::replace_text(viewer ? folder / "plain.html" : index, page(input, pairs, figures, scenes, viewer));
  if (viewer) write_viewer(input, pairs, figures, folder);
  return index;
}

}  // namespace geocage::reports
