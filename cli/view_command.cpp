#include <algorithm>
#include <fstream>
#include <system_error>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "cli/console.h"
#include "cli/run_report.h"
#include "geometry/cloud_files.h"
#include "geometry/mesh_files.h"
#include "hands/grasp.h"
#include "pipeline/spelling.h"
#include "pipeline/text_file.h"
#include "reports/pair_page.h"
#include "reports/viewer_files.h"
#include "stages/import/import.h"

namespace geocage::cli {

namespace fs = std::filesystem;
using nlohmann::json;
using pipeline::Fault;
using pipeline::UserError;

namespace {

/// A PLY that geocage wrote with a column of winding angles.
bool has_scores(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::string head(4096, '\0');
  in.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(in.gcount()));
  return head.starts_with("ply") && head.find(" winding_angle_rad\n") != std::string::npos;
}

topology::Scores read_scores(const fs::path& file) {
  topology::Scores scores;
  std::vector<geometry::VertexField> columns;
  try {
    scores.mesh = geometry::read_own_ply(file, &columns);
  } catch (const std::system_error&) {
    throw UserError(Fault::input, file.string(), "its columns are not as geocage writes them",
                    "`geocage score --out FILE.ply` writes them");
  }
  const auto whole = [](const std::vector<double>& values) {
    return std::vector<int>(values.begin(), values.end());
  };
  for (auto& column : columns) {
    if (column.name == "winding_angle_rad")
      scores.ball.winding_angle_rad = std::move(column.values);
    else if (column.name == "curvature_sum_rad")
      scores.ball.curvature_sum_rad = std::move(column.values);
    else if (column.name == "observed")
      scores.mesh.observed = std::move(column.values);
    else if (column.name == "ball_vertices")
      scores.ball.ball_vertices = whole(column.values);
    else if (column.name == "euler")
      scores.ball.euler = whole(column.values);
  }
  return scores;
}

json read_json(const fs::path& file) {
  std::ifstream in(file);
  if (!in) throw UserError(Fault::input, file.string(), "there is no such file");
  try {
    return json::parse(in);
  } catch (const json::exception&) {
    throw UserError(Fault::input, file.string(), "this is not JSON");
  }
}

/// A way from anywhere has a pose and a number for each joint at every step.
void check_way(const json& way, const std::string& where) {
  const auto expect = [&](bool good, const char* sentence) {
    if (!good) throw UserError(Fault::input, where, sentence, "docs/formats.md tells the format");
  };
  for (const char* key : {"joints", "q_rad", "X_OH"})
    expect(way.contains(key) && way[key].is_array(), "'joints', 'q_rad' and 'X_OH' must be lists");
  expect(way.contains("dt_s") && way["dt_s"].is_number() && way["dt_s"] > 0,
         "'dt_s' must be a number above 0");
  expect(std::ranges::all_of(way["joints"], &json::is_string), "'joints' must be names");
  expect(!way["q_rad"].empty(), "it has no steps");
  expect(way["q_rad"].size() == way["X_OH"].size(), "'X_OH' must have a pose for each row of 'q_rad'");
  for (const json& row : way["q_rad"])
    expect(row.is_array() && row.size() == way["joints"].size() && std::ranges::all_of(row, &json::is_number),
           "a row of 'q_rad' must have a number for each joint");
  for (const json& pose : way["X_OH"]) hands::pose_from_json(pose, where);
}

/// Files become pairs: a mesh or cloud begins one, what follows joins it.
class Shelf {
 public:
  Shelf(const ViewOptions& options, fs::path out) : options_(options), out_(std::move(out)) {}

  void add(const fs::path& file) {
    if (!fs::exists(file)) throw UserError(Fault::input, file.string(), "there is no such file");
    if (file.extension() == ".json")
      add_document(file);
    else if (has_scores(file))
      fresh(file).scores = read_scores(file);
    else if (geometry::is_cloud_file(file))
      add_cloud(file);
    else
      add_mesh(file);
  }

  std::vector<reports::PairResults> pairs;
  std::vector<hands::Hand> hands;

 private:
  reports::PairResults& fresh(const fs::path& file) {
    auto& pair = pairs.emplace_back();
    pair.input.object = pipeline::plain_name(file.stem().string());
    pair.input.source = file.string();
    pair.input.outcome = "done";
    return pair;
  }

  void add_mesh(const fs::path& file) {
    stages::ImportParams params;
    params.unit = options_.unit;
    params.repair = "none";
    pipeline::Run run;
    auto mesh = stages::import_mesh(params, run, geometry::SourceFile{file});
    fresh(file).scores.emplace().mesh = std::move(mesh);
  }

  void add_cloud(const fs::path& file) {
    stages::ImportParams params;
    params.unit = options_.unit;
    params.scene = "object";
    pipeline::Run run;
    auto cloud = stages::import_cloud(params, run, geometry::SourceFile{file});
    auto& pair = pairs.empty() || pairs.back().cloud ? fresh(file) : pairs.back();
    if (!pair.scores) pair.scores.emplace();
    pair.cloud = std::move(cloud);
  }

  void add_document(const fs::path& file) {
    const json content = read_json(file);
    const bool named = content.is_object() && content.contains("schema") && content["schema"].is_string();
    const std::string schema = named ? content["schema"].get<std::string>() : "";
    if (schema.starts_with("geocage-grasp"))
      add_grasps(file);
    else if (schema == "geocage-trajectory 1")
      add_way(file, content);
    else
      throw UserError(Fault::input, file.string(),
                      schema.empty() ? "this file has no schema" : "'" + schema + "' can't be shown",
                      "grasps and trajectories can");
  }

  reports::PairResults& current(const fs::path& file) { return pairs.empty() ? fresh(file) : pairs.back(); }

  const hands::Hand& hand_of(const std::string& name) {
    auto known = std::ranges::find(hands, name, &hands::Hand::name);
    if (known == hands.end()) known = hands.insert(hands.end(), hands::load_hand(name));
    return *known;
  }

  void add_grasps(const fs::path& file) {
    auto set = hands::read_grasps(file);
    if (set.grasps.empty()) throw UserError(Fault::input, file.string(), "this file holds no grasp");
    reports::PairResults& pair = current(file);
    const hands::Hand& hand = hand_of(options_.hand.empty() ? set.grasps.front().hand : options_.hand);
    pair.input.hand = hand.name;
    pair.grasps = std::move(set);
  }

  /// A way without a grasp ends in one.
  void add_way(const fs::path& file, const json& content) {
    check_way(content, file.string());
    reports::PairResults& pair = current(file);
    if (!pair.grasps) {
      if (options_.hand.empty())
        throw UserError(Fault::configuration, file.string(), "a trajectory does not say of which hand",
                        "add --hand NAME, or the grasp's file before it");
      const hands::Hand& hand = hand_of(options_.hand);
      hands::Grasp grasp;
      grasp.hand = hand.name;
      grasp.X_OH = hands::pose_from_json(content.at("X_OH").back(), file.string());
      for (std::size_t i = 0; i < content.at("joints").size(); ++i)
        grasp.joints_rad[content["joints"][i]] = content["q_rad"].back().at(i);
      hands::joint_vector(hand.tree, grasp.joints_rad, file.string());
      pair.input.hand = hand.name;
      pair.grasps.emplace().grasps = {grasp};
    }
    const fs::path folder = out_ / "ways" / std::to_string(pairs.size());
    const auto place = [&](int i) { return folder / fmt::format("trajectory_{}.json", i); };
    int next = 0;
    if (pair.input.trajectories.empty())  // of an earlier view
      for (int i = 0; fs::remove(place(i)); ++i) {
      }
    fs::create_directories(folder);
    while (fs::exists(place(next))) ++next;
    fs::copy_file(file, place(next));
    pair.input.trajectories = folder;
  }

  const ViewOptions& options_;
  fs::path out_;
};

}  // namespace

namespace {

int write_view(const Shared& shared, const ViewOptions& options, const fs::path& out) {
  const auto alone = alone_in(out);
  forget_report(out);
  Shelf shelf(options, out);
  for (const auto& file : options.files) shelf.add(file);
  fs::create_directories(out / "pictures");
  std::vector<std::string> models;
  for (std::size_t i = 0; i < shelf.pairs.size(); ++i) {
    const fs::path file = out / fmt::format("{}-{}.glb", i + 1, shelf.pairs[i].input.object);
    const auto model = reports::pair_glb(shelf.pairs[i], shelf.hands);
    pipeline::replace_text(file, {reinterpret_cast<const char*>(model.data()), model.size()});
    models.push_back(file.string());
  }
  fs::path page;  // empty: there are no scripts to make one
  if (reports::viewer_is_built(viewer_folder())) {
    reports::ReportInput input;
    input.title = options.files.front().filename().string();
    input.viewer = viewer_folder();
    input.hands = shelf.hands;
    input.run = {{"geocage", GEOCAGE_VERSION}};
    reports::write_viewer(input, shelf.pairs, std::vector<std::vector<reports::Figure>>(shelf.pairs.size()),
                          out);
    page = reports::write_single_file(out);
  } else {
    tell(
        "geocage: there is no page, its scripts were not built (node, npm or the network was "
        "missing); a glTF viewer opens the models\n");
  }
  if (shared.json)
    print_json(json{{"schema", "geocage-view 1"},
                    {"page", page.empty() ? json() : json(page.string())},
                    {"models", models}});
  else
    fmt::print("{}\n", page.empty() ? fmt::format("{}", fmt::join(models, "\n")) : page.string());
  return 0;
}

}  // namespace

int view(const Shared& shared, const ViewOptions& options) {
  const fs::path out = shared.out == "report" ? fs::path("view") : shared.out;
  std::error_code error;
  const bool was_there = fs::exists(out, error);
  try {
    return write_view(shared, options, out);
  } catch (...) {
    if (!was_there) fs::remove_all(out, error);
    throw;
  }
}

}  // namespace geocage::cli
