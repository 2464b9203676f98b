#include "reports/viewer_files.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <system_error>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "geometry/distance_field.h"
#include "hands/closing.h"
#include "pipeline/text_file.h"
#include "reports/html.h"
#include "reports/packed.h"
#include "reports/scenes.h"
#include "topology/balls.h"

namespace geocage::reports {

namespace fs = std::filesystem;
using geometry::Pose;
using geometry::Vec3;
using nlohmann::json;

namespace {

constexpr const char* parts_of_viewer[] = {"app.js", "scene.js", "plots.js", "app.css"};
constexpr std::size_t most_steps = 80;  ///< of a way that is played

using pipeline::read_text;
using pipeline::write_text;

/// Names may hold bytes that are no UTF-8.
std::string text_of(const json& document) {
  return document.dump(-1, ' ', false, json::error_handler_t::replace);
}

json number(double x) {
  return std::isfinite(x) ? json(x) : json();
}

/// Rounded so that text is short: for what is drawn, never for what is read.
double rounded(double x, double step) {
  return std::round(x / step) * step;
}
json short_point(const Vec3& p) {
  constexpr double tenth_mm = 1e-4;
  json list = json::array();
  for (int k = 0; k < 3; ++k) list.push_back(std::round(p[k] / tenth_mm) / 1e4);
  return list;
}

json cells_of(const TableInput& table) {
  struct Shown {
    json operator()(std::monostate) const { return nullptr; }
    json operator()(double x) const { return number(x); }
    json operator()(const std::string& text) const { return text; }
  };
  json rows = json::array();
  for (const auto& row : table.rows) {
    json& cells = rows.emplace_back(json::array());
    for (const auto& cell : row) cells.push_back(std::visit(Shown{}, cell));
  }
  return {{"name", table.name}, {"columns", table.columns}, {"rows", rows}};
}

json of_proportion(const Proportion& rate) {
  return {{"share", rate.share}, {"low", rate.low}, {"high", rate.high}};
}

/// Held among all rows of the table of grasps, by each of these columns.
json success_by(const TableInput& grasps, const std::vector<std::string>& columns) {
  const auto place = [&](const std::string& name) {
    return static_cast<std::size_t>(std::ranges::find(grasps.columns, name) - grasps.columns.begin());
  };
  const std::size_t held = place("held");
  json list = json::array();
  if (held == grasps.columns.size()) return list;
  for (const std::string& name : columns) {
    const std::size_t at = place(name);
    if (at == grasps.columns.size()) continue;
    std::map<std::variant<std::monostate, double, std::string>, std::pair<int, int>> groups;
    for (const auto& row : grasps.rows) {
      auto& [hits, rows] = groups[row[at]];
      const auto* value = std::get_if<double>(&row[held]);
      hits += value && *value == 1;
      ++rows;
    }
    for (const auto& [value, counts] : groups) {
      json entry = {{"by", name}, {"held", counts.first}, {"rows", counts.second}};
      entry.update(of_proportion(wilson(counts.first, counts.second)));
      if (const auto* x = std::get_if<double>(&value))
        entry["value"] = *x;
      else
        entry["value"] =
            std::holds_alternative<std::string>(value) ? json(std::get<std::string>(value)) : json();
      list.push_back(entry);
    }
  }
  return list;
}

/// A JSON file of an artefact; null when it is not there.
json document(const fs::path& folder, const std::string& name) {
  std::ifstream in(folder / name);
  return folder.empty() || !in ? json() : json::parse(in);
}

/// Entries of evaluations.json or cages.json by their grasp. Paths of a search are long and not drawn.
std::map<int, json> entries_of(const json& file) {
  std::map<int, json> entries;
  if (file.is_null()) return entries;
  for (json entry : file.at("evaluations")) {
    const int grasp = entry.at("grasp");
    for (const char* key : {"engine", "counts", "schema", "protocol"}) entry.erase(key);
    if (const auto search = entry.find("escape_search"); search != entry.end()) search->erase("X_WO");
    entries[grasp] = std::move(entry);
  }
  return entries;
}

json without_entries(json file) {
  if (file.is_null()) return file;
  if (!file.at("evaluations").empty() && file["evaluations"][0].contains("engine"))
    file["engine"] = file["evaluations"][0]["engine"];
  file.erase("evaluations");
  return file;
}

/// A trajectory with fewer and shorter numbers: it is played, not measured.
json way_of(const fs::path& folder, std::size_t grasp) {
  json way = document(folder, fmt::format("trajectory_{}.json", grasp));
  if (way.is_null()) return way;
  const std::size_t steps = way.at("q_rad").size();
  const double dt_s = way.value("dt_s", 0.0);
  const std::size_t stride = std::max<std::size_t>(1, (steps + most_steps - 1) / most_steps);
  json times = json::array(), q = json::array(), X = json::array();
  std::vector<std::size_t> shown;
  for (std::size_t i = 0; i + 1 < steps; i += stride) shown.push_back(i);
  if (steps > 0) shown.push_back(steps - 1);
  for (const std::size_t i : shown) {
    times.push_back(rounded(static_cast<double>(i) * dt_s, 1e-4));
    json& row = q.emplace_back(json::array());
    for (const json& x : way["q_rad"][i]) row.push_back(std::round(x.get<double>() * 1e4) / 1e4);
    if (i >= way["X_OH"].size()) continue;
    json& pose = X.emplace_back(json::array());
    for (const json& x : way["X_OH"][i]["p_m"]) pose.push_back(std::round(x.get<double>() * 1e5) / 1e5);
    for (const json& x : way["X_OH"][i]["q_wxyz"]) pose.push_back(std::round(x.get<double>() * 1e5) / 1e5);
  }
  json told = way;
  for (const char* key : {"q_rad", "X_OH", "schema"}) told.erase(key);
  told["seconds"] = steps > 1 ? static_cast<double>(steps - 1) * dt_s : 0.0;
  told["times_s"] = times, told["q"] = q, told["X"] = X;
  return told;
}

json short_pose(const json& pose) {
  json list = json::array();
  for (const char* key : {"p_m", "q_wxyz"})
    for (const json& x : pose.at(key)) list.push_back(std::round(x.get<double>() * 1e5) / 1e5);
  return list;
}

/// Recorded trials by their grasp, with shorter numbers; what never changes is there once.
void add_recordings(const fs::path& folder, std::map<int, json>& of_grasp) {
  const json file = document(folder, "recordings.json");
  if (file.is_null()) return;
  for (const json& recording : file.at("recordings")) {
    json hand = json::array(), object = json::array(), q = json::array(), times = json::array();
    for (const json& t : recording.at("t_s")) times.push_back(rounded(t, 1e-3));
    for (const json& pose : recording.at("X_WH")) hand.push_back(short_pose(pose));
    for (const json& pose : recording.at("X_WO")) object.push_back(short_pose(pose));
    for (const json& row : recording.at("q_rad")) {
      json& values = q.emplace_back(json::array());
      for (const json& x : row) values.push_back(std::round(x.get<double>() * 1e4) / 1e4);
    }
    for (json* list : {&hand, &q})
      if (std::ranges::all_of(*list, [&](const json& x) { return x == list->front(); }) && !list->empty())
        *list = json::array({list->front()});
    of_grasp[recording.at("grasp")].push_back({{"trial", recording.at("trial")},
                                               {"outcome", recording.at("outcome")},
                                               {"protocol", recording.at("protocol")},
                                               {"joints", recording.at("joints")},
                                               {"times_s", times},
                                               {"X_WH", hand},
                                               {"X_WO", object},
                                               {"q", q},
                                               {"phase", recording.at("phase")}});
  }
}

/// Where the closed hand touches: the same question with the same answer as in `place`.
json contacts_of(const hands::Hand& hand, const geometry::SignedDistanceField& field,
                 const hands::Grasp& grasp, const Eigen::VectorXd& q) {
  std::vector<Pose> X_HL;
  hands::forward_kinematics(hand.tree, q, X_HL);
  std::vector<hands::PlacedCapsule> placed;
  hands::place_capsules(hand, grasp.X_OH, X_HL, placed);
  json list = json::array();
  for (const auto& contact : hands::contacts_of(hand, field, placed, hands::ClosingRule{}.contact_m))
    list.push_back({{"link", hand.tree.links[contact.link]},
                    {"p", short_point(contact.p_O)},
                    {"n", short_point(contact.n_O)}});
  return list;
}

/// The ball's section of a candidate, for the picture of its path.
json section_of(const topology::Scores& scores, const topology::Candidate& candidate,
                const std::string& metric) {
  const auto ball =
      topology::section_of_ball(scores.mesh, candidate.vertex, scores.ball.radius_m,
                                metric == "dijkstra" ? topology::Metric::dijkstra : topology::Metric::hop);
  json path = json::array();
  for (const Vec3& p : ball.section.path) path.push_back(short_point(p));
  json told = {{"path", path}, {"closed", ball.section.closed}, {"vertices", ball.vertices.size()}};
  if (ball.has_axis) told["center"] = short_point(ball.center), told["axis"] = short_point(ball.axis);
  return told;
}

constexpr const char* file_list = "viewer/files.txt";  ///< what the pages load

/// The files that an earlier report in the folder lists as its own; all others are somebody else's.
std::vector<std::string> listed(const fs::path& folder) {
  std::vector<std::string> files;
  std::ifstream list(folder / file_list);
  for (std::string name; std::getline(list, name);) {
    const bool inside = name.find("..") == std::string::npos;
    if (inside && (name.starts_with("data/") || name.starts_with("pictures/"))) files.push_back(name);
  }
  return files;
}

class Writer {
 public:
  Writer(const ReportInput& input, const std::vector<PairResults>& pairs,
         const std::vector<std::vector<Figure>>& figures, const fs::path& folder)
      : input_(input), pairs_(pairs), figures_(figures), folder_(folder) {}

  void write() {
    const std::vector<std::string> before = listed(folder_);
    fs::create_directories(folder_ / "data");
    fs::create_directories(folder_ / "viewer");
    for (const char* part : parts_of_viewer)
      fs::copy_file(input_.viewer / part, folder_ / "viewer" / part, fs::copy_options::overwrite_existing);
    json hands = json::array(), list = json::array();
    for (const auto& hand : input_.hands) {
      if (hand.net) continue;
      const std::string name = "hand-" + plain_name(hand.name);
      put(name, hand_glb(hand));
      hands.push_back({{"name", hand.name}, {"model", name}, {"dofs", hand.tree.dof_names}});
    }
    for (std::size_t i = 0; i < pairs_.size(); ++i) list.push_back(pair(i));
    put_text("overview", text_of(overview(std::move(list), std::move(hands))));
    for (const auto& figures : figures_)
      for (const Figure& figure : figures) files_.insert("pictures/" + figure.file);
    std::string names;
    for (const auto& file : files_) names += file + "\n";
    write_text(folder_ / file_list, names);
    for (const std::string& file : before)
      if (!files_.contains(file)) fs::remove(folder_ / file);
  }

 private:
  void put(const std::string& name, std::span<const std::uint8_t> bytes) { put_packed(name, packed(bytes)); }
  void put_text(const std::string& name, const std::string& text) { put_packed(name, packed(text)); }
  void put_packed(const std::string& name, const std::string& text) {
    files_.insert("data/" + name + ".js");
    write_text(folder_ / "data" / (name + ".js"), fmt::format("geocage.put(\"{}\",\"{}\");\n", name, text));
  }

  const hands::Hand* hand_of(const PairResults& pair) const {
    const auto hand = std::ranges::find(input_.hands, pair.input.hand, &hands::Hand::name);
    return hand == input_.hands.end() ? nullptr : &*hand;
  }

  /// Of the first pair with these scores; others name the same file.
  std::string model_of(const PairResults& pair, std::size_t index) {
    if (!pair.scores) return "";
    auto [known, fresh] =
        models_.try_emplace(pair.input.scores.empty() ? fs::path(std::to_string(index)) : pair.input.scores,
                            fmt::format("object-{}", index + 1));
    if (fresh)
      put(known->second, object_glb(*pair.scores, pair.cloud ? &*pair.cloud : nullptr, pair.input.occupancy));
    return known->second;
  }

  json pair(std::size_t index) {
    const PairResults& pair = pairs_[index];
    const PairInput& in = pair.input;
    json figures = json::array();
    for (const Figure& figure : figures_[index])
      figures.push_back({{"file", "pictures/" + figure.file}, {"title", figure.title}});
    json told = {{"object", in.object},
                 {"base", in.base.empty() ? in.object : in.base},
                 {"hand", in.hand},
                 {"outcome", in.outcome},
                 {"sentence", in.sentence},
                 {"source", in.source},
                 {"truth_known", in.truth_known},
                 {"levels", in.levels},
                 {"model", model_of(pair, index)},
                 {"figures", figures}};
    if (const hands::Hand* hand = hand_of(pair); hand && !hand->net)
      told["hand_model"] = "hand-" + plain_name(in.hand);
    if (pair.grasps || pair.scores) {
      const std::string name = fmt::format("pair-{}", index + 1);
      put_text(name, text_of(details(pair, index, told)));
      told["details"] = name;
    }
    return told;
  }

  json details(const PairResults& pair, std::size_t index, json& told) {
    const Vec3 up = pair.up_O();
    const json evaluations = document(pair.input.evaluations, "evaluations.json"),
               cages = document(pair.input.cages, "cages.json");
    json all = {{"up", {up.x(), up.y(), up.z()}}, {"evaluation", without_entries(evaluations)},
                {"cage", without_entries(cages)}, {"candidates", candidates(pair)},
                {"grasps", json::array()},        {"rejected", json::object()},
                {"metric", pair.input.metric}};
    if (!pair.grasps) return all;
    for (const auto& [rule, count] : pair.grasps->rejected) all["rejected"][rule] = count;
    const auto tests = entries_of(evaluations), cage_tests = entries_of(cages);
    std::map<int, json> recordings;
    add_recordings(pair.input.evaluations, recordings);
    add_recordings(pair.input.cages, recordings);
    std::optional<geometry::SignedDistanceField> field;
    if (!pair.input.field.empty()) load_artefact(field.emplace(), pair.input.field);
    json small = json::array();
    for (std::size_t i = 0; i < pair.grasps->grasps.size(); ++i) {
      const int key = static_cast<int>(i);
      json& grasp = all["grasps"].emplace_back(grasp_of(pair, i, field ? &*field : nullptr));
      if (const auto test = tests.find(key); test != tests.end()) grasp["evaluation"] = test->second;
      if (const auto test = cage_tests.find(key); test != cage_tests.end()) grasp["cage"] = test->second;
      if (const auto seen = recordings.find(key); seen != recordings.end())
        grasp["recordings"] = seen->second;
      small.push_back(small_picture(pair, i, index));
    }
    told["pictures"] = small;
    return all;
  }

  static json candidates(const PairResults& pair) {
    json list = document(pair.input.scores, "candidates.json");
    if (list.is_null() || !pair.scores) return json::array();
    list = list.at("candidates");
    // The file and the loaded scores hold the same candidates in the same order.
    for (std::size_t i = 0; i < list.size(); ++i)
      list[i]["ball"] = section_of(*pair.scores, pair.scores->candidates[i], pair.input.metric);
    return list;
  }

  json grasp_of(const PairResults& pair, std::size_t i, const geometry::SignedDistanceField* field) const {
    const hands::Grasp& grasp = pair.grasps->grasps[i];
    json told = hands::to_json(grasp);
    told["approach"] = way_of(pair.input.trajectories, i);
    const hands::Hand* hand = hand_of(pair);
    if (!hand || hand->net || grasp.joints_rad.empty()) return told;
    const auto q = hands::joint_vector(hand->tree, grasp.joints_rad, pair.input.grasps.string());
    if (field) told["contacts"] = contacts_of(*hand, *field, grasp, q);
    return told;
  }

  /// A picture of 128 x 96, named after what it shows: one that is there needs not be drawn again.
  std::string small_picture(const PairResults& pair, std::size_t i, std::size_t index) {
    const hands::Hand* hand = hand_of(pair);
    const hands::Grasp& grasp = pair.grasps->grasps[i];
    if (!pair.scores || pair.scores->mesh.triangles.empty() || !hand || hand->net || grasp.joints_rad.empty())
      return "";
    const std::string made_of = pair.input.grasps.filename().string();
    const std::string name = fmt::format(
        "small-{}-{}-128.png", made_of.size() >= 32 ? made_of.substr(0, 20) : std::to_string(index + 1), i);
    const fs::path file = folder_ / "pictures" / name;
    files_.insert("pictures/" + name);
    if (made_of.size() < 32 || !fs::exists(file)) {
      const auto q = hands::joint_vector(hand->tree, grasp.joints_rad, pair.input.grasps.string());
      const auto& values = pair.scores->ball.winding_angle_rad;
      const auto& mesh = pair.scores->mesh;
      const bool scored = values.size() == mesh.vertices.size();
      const std::vector<double> plain(mesh.vertices.size());
      const Studio studio({coloured_surface(mesh, scored ? values : plain, sequential_scale(values)),
                           hand_part(*hand, grasp.X_OH, q)});
      write_indexed_png(file,
                        studio.picture(clearest_view(studio, pair.up_O()), {.width = 128, .height = 96}));
    }
    return "pictures/" + name;
  }

  json overview(json pairs, json hands) const {
    const Counts& c = input_.counts;
    json slots = json::array(), parameters = json::array(), failures = json::array(), tables = json::array();
    for (const SlotInput& slot : input_.slots)
      slots.push_back({{"slot", slot.slot},
                       {"stage", slot.stage},
                       {"state", slot.state},
                       {"seconds", slot.state == "hit" ? slot.made_seconds : slot.seconds},
                       {"folder", slot.folder.string()},
                       {"sentence", slot.sentence},
                       {"metrics", slot.figures()}});
    for (const auto& [slot, list] : input_.parameters) {
      json values = json::array();
      for (const auto& parameter : list) values.push_back({parameter.name, parameter.value, parameter.from});
      parameters.push_back({{"slot", slot}, {"values", values}});
    }
    for (const auto& failure : input_.failures)
      failures.push_back({{"slot", failure.slot},
                          {"code", failure.code},
                          {"sentence", failure.sentence},
                          {"command", failure.command}});
    std::vector<std::string> columns = {"object", "hand", "heuristic"};
    for (const PairInput& pair : input_.pairs)
      for (const auto& [name, value] : pair.levels)
        if (!name.ends_with(".seed") && std::ranges::count(columns, name) == 0) columns.push_back(name);
    json success = json::array();
    for (const TableInput& table : input_.tables) {
      tables.push_back(cells_of(table));
      if (table.name == "grasps") success = success_by(table, columns);
    }
    return {{"schema", "geocage-report 1"},
            {"title", input_.title},
            {"counts",
             {{"in", c.in},
              {"done", c.done},
              {"failed", c.failed},
              {"rejected", c.rejected},
              {"skipped", c.skipped}}},
            {"run", input_.run},
            {"flow", input_.flow_text},
            {"hands", hands},
            {"pairs", pairs},
            {"slots", slots},
            {"parameters", parameters},
            {"failures", failures},
            {"tables", tables},
            {"success", success}};
  }

  const ReportInput& input_;
  const std::vector<PairResults>& pairs_;
  const std::vector<std::vector<Figure>>& figures_;
  const fs::path& folder_;
  std::map<fs::path, std::string> models_;
  std::set<std::string> files_;  ///< that the pages load
};

/// `files` are the scripts in order: paths in a folder, or what stands for them in a single file.
std::string shell(const std::string& title, const std::string& style, const std::string& scripts,
                  const std::string& otherwise) {
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width, initial-scale=1\"><title>{}</title>{}</head><body>"
      "<div id=\"app\"></div><noscript>{}</noscript>{}</body></html>\n",
      escaped(title), style, otherwise, scripts);
}

/// Text inside <script> may not hold what ends it; in a script's string or pattern `<\/` means the same.
std::string harmless(std::string text) {
  for (std::size_t at = 0; (at = text.find("</script", at)) != std::string::npos; at += 3)
    text.insert(at + 1, "\\");
  return text;
}

}  // namespace

bool viewer_is_built(const fs::path& viewer) {
  return !viewer.empty() &&
         std::ranges::all_of(parts_of_viewer, [&](const char* part) { return fs::exists(viewer / part); });
}

void write_viewer(const ReportInput& input, const std::vector<PairResults>& pairs,
                  const std::vector<std::vector<Figure>>& figures, const fs::path& folder) {
  Writer(input, pairs, figures, folder).write();
  pipeline::replace_text(
      folder / "index.html",
      shell(input.title, "<link rel=\"stylesheet\" href=\"viewer/app.css\">",
            "<script src=\"viewer/app.js\"></script>",
            "<p>These pages need JavaScript. <a href=\"plain.html\">The plain page</a> doesn’t.</p>"));
}

fs::path write_single_file(const fs::path& folder) {
  std::string scripts;
  const auto add = [&](const std::string& name, const std::string& text) {
    scripts += fmt::format("<script type=\"text/plain\" data-file=\"{}\">{}</script>\n", name, text);
  };
  for (const char* part : {"scene.js", "plots.js"})
    add(fmt::format("viewer/{}", part), harmless(read_text(folder / "viewer" / part)));
  std::istringstream files(read_text(folder / file_list));
  for (std::string name; std::getline(files, name);) {
    const std::string bytes = read_text(folder / name);
    if (name.ends_with(".png"))
      add(name, "data:image/png;base64," +
                    base64(std::span(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size())));
    else
      add(name, bytes);
  }
  scripts += "<script>" + harmless(read_text(folder / "viewer" / "app.js")) + "</script>";
  const std::string index = read_text(folder / "index.html");
  const std::size_t from = index.find("<title>") + 7;
  std::string title = index.substr(from, index.find("</title>") - from);
  fs::path single = folder / "report.html";
  // The title is escaped already.
  std::string page = shell("", "<style>" + read_text(folder / "viewer" / "app.css") + "</style>", scripts,
                           "<p>These pages need JavaScript.</p>");
  page.insert(page.find("<title>") + 7, title);
  pipeline::replace_text(single, page);
  return single;
}

}  // namespace geocage::reports
