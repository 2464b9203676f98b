#include <algorithm>
#include <cmath>
#include <iostream>
#include <iterator>
#include <sstream>
#include <thread>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "cli/console.h"
#include "geometry/mesh_files.h"
#include "geometry/source_file.h"
#include "pipeline/text_file.h"
#include "pipeline/worker.h"
#include "topology/balls.h"
#include "topology/writhe.h"

namespace geocage::cli {

namespace fs = std::filesystem;
using nlohmann::json;
using pipeline::Fault;
using pipeline::UserError;

namespace {

/// Keeps what was said.
class Listener : public pipeline::Run {
 public:
  void log(std::string_view sentence) override { said += std::string(sentence) + "\n"; }
  std::string said;
};

/// A foreign mesh, read in a worker process; it must be a closed manifold.
geometry::TriangleMesh closed_mesh(const fs::path& file, const std::string& unit, int decimate,
                                   Listener& run) {
  stages::ImportParams params;
  params.unit = unit;
  params.decimate = decimate;
  params.repair = decimate > 0 ? "repair" : "none";  // collapses may leave edges of three triangles
  auto mesh = stages::import_mesh(params, run, geometry::SourceFile{file});
  const auto report = geometry::check_mesh(mesh);
  if (!report.closed_manifold())
    throw UserError(Fault::input, file.string(), "this is not a closed manifold: " + geometry::flaw(report),
                    "mend the mesh, or let `geocage run --dataset` reconstruct it");
  return mesh;
}

/// A tool's work on a foreign mesh is a worker's, as a slot's is.
pipeline::WorkerLimits tool_limits() {
  return {.seconds = 3600,
          .memory_gib = 4,
          .threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency())),
          .subject = "the work on it",
          .hint = "a mesh with fewer triangles takes less"};
}

using pipeline::read_text;
using pipeline::write_text;

std::string csv_of(const geometry::TriangleMesh& mesh, const topology::BallFields& ball) {
  std::string csv =
      "vertex,x_m,y_m,z_m,winding_angle_rad,curvature_sum_rad,ball_vertices,ball_triangles,euler\n";
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const auto& p = mesh.vertices[v];
    csv +=
        fmt::format("{},{},{},{},{},{},{},{},{}\n", v, p.x(), p.y(), p.z(), ball.winding_angle_rad[v],
                    ball.curvature_sum_rad[v], ball.ball_vertices[v], ball.ball_triangles[v], ball.euler[v]);
  }
  return csv;
}

/// The columns of the contract.
std::vector<geometry::VertexField> fields_of(const topology::BallFields& ball) {
  auto columns = topology::columns_of(ball);
  columns.resize(5);
  return columns;
}

/// A list a column, in the order of vertices; NaN is null.
json json_of(const topology::BallFields& ball) {
  json columns;
  for (const auto& column : fields_of(ball)) columns[column.name] = column.values;
  return columns;
}

}  // namespace

int score(const Shared& shared, const ScoreOptions& options) {
  const std::string kind = options.out.extension();
  if (!options.out.empty() && kind != ".ply" && kind != ".csv")
    throw UserError(Fault::configuration, "--out " + options.out.string(),
                    "the file must end in .ply or .csv");
  if (options.out.has_parent_path() && !fs::is_directory(options.out.parent_path()))
    throw UserError(Fault::configuration, "--out " + options.out.string(), "its folder is not there");
  const bool printed = options.out.empty();
  const std::string name = printed && shared.json ? "scores.json" : "scores" + (printed ? ".csv" : kind);
  std::size_t vertices = 0;
  std::string text;
  const auto work = [&](const fs::path& folder) {
    Listener run;
    const auto mesh = closed_mesh(options.mesh, options.unit, options.decimate, run);
    write_text(folder / "said", run.said);
    const auto metric = options.metric == "hop" ? topology::Metric::hop : topology::Metric::dijkstra;
    const auto ball = topology::ball_fields(mesh, {options.radius_m}, metric).radii.front();
    write_text(folder / "vertices", std::to_string(mesh.vertices.size()));
    if (name == "scores.ply")
      geometry::write_ply(folder / name, mesh, fields_of(ball));
    else if (name == "scores.json")
      write_text(folder / name, json_of(ball).dump());
    else
      write_text(folder / name, csv_of(mesh, ball));
  };
  const auto collect = [&](const fs::path& folder) {
    vertices = std::stoul(read_text(folder / "vertices"));
    if (!shared.quiet) tell(read_text(folder / "said"));
    if (!printed)
      pipeline::replace_text(options.out, read_text(folder / name));
    else
      text = read_text(folder / name);
  };
  pipeline::run_contained(tool_limits(), options.mesh.string(), work, collect);
  if (shared.json)
    print_json(json{{"schema", "geocage-score 1"},
                    {"vertices", vertices},
                    {"radius_m", options.radius_m},
                    {"metric", options.metric},
                    {"out", printed ? json() : json(options.out.string())},
                    {"scores", printed ? json::parse(text) : json()}},
               -1);
  else if (printed)
    fmt::print("{}", text);
  else if (!shared.quiet)
    tell(fmt::format("{} vertices scored: {}\n", vertices, options.out.string()));
  return 0;
}

namespace {

/// One sentence where the linking integral has no value.
void tell_touching(const topology::Polyline& a, const topology::Polyline& b, const Eigen::MatrixXd& omega) {
  for (Eigen::Index i = 0; i < omega.rows(); ++i)
    for (Eigen::Index j = 0; j < omega.cols(); ++j)
      if (omega(i, j) == 0 && topology::segments_touch(a[i], a[i + 1], b[j], b[j + 1])) {
        tell(
            fmt::format("the curves touch, at segment {} of the first and {} of the second: the linking "
                        "integral jumps there, and 0 is written for segments that touch\n",
                        i, j));
        return;
      }
}

}  // namespace

int writhe(const Shared& shared, const WritheOptions& options) {
  auto a = topology::read_polyline(options.a), b = topology::read_polyline(options.b);
  if (options.closed) {
    a.push_back(a.front());
    b.push_back(b.front());
  }
  const Eigen::MatrixXd omega = topology::writhe_matrix(a, b);
  if (!shared.quiet) tell_touching(a, b, omega);
  const double gli = topology::gauss_linking_integral(a, b);
  if (!shared.json) {
    for (Eigen::Index i = 0; i < omega.rows(); ++i)
      for (Eigen::Index j = 0; j < omega.cols(); ++j)
        fmt::print("{}{}", omega(i, j), j + 1 < omega.cols() ? "," : "\n");
    fmt::print("gli {}\n", gli);
    return 0;
  }
  json rows = json::array();
  for (Eigen::Index i = 0; i < omega.rows(); ++i) {
    json row = json::array();
    for (Eigen::Index j = 0; j < omega.cols(); ++j) row.push_back(omega(i, j));
    rows.push_back(row);
  }
  print_json(json{{"omega_sr", rows}, {"gli", gli}}, -1);
  return 0;
}

namespace {

const std::string cage_protocol = physics::CageProtocol{}.name;

/// One protocol, or several in a row; UserError for an unknown one.
std::vector<std::string> protocols_of(const std::string& text) {
  auto known = physics::protocol_names();
  known.push_back(cage_protocol);
  if (text == "all") return known;
  std::vector<std::string> names;
  std::istringstream parts(text);
  for (std::string name; std::getline(parts, name, ',');) {
    if (std::ranges::count(known, name) == 0)
      throw UserError(Fault::configuration, "--protocol", "there is no protocol '" + name + "'",
                      fmt::format("known: {}", fmt::join(known, ", ")));
    names.push_back(name);
  }
  return names;
}

/// A foreign mesh or grasp may bring a library down: that ends a worker, and is told in words.
pipeline::WorkerLimits limits_of_evaluation() {
  pipeline::WorkerLimits limits{.seconds = 3600, .memory_gib = 4};
  limits.threads = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  limits.subject = "the simulation";
  limits.hint = "look at the mesh with `geocage score`; if it is sound, please report this with both files";
  return limits;
}

/// What one protocol said of every grasp: entries "geocage-evaluation 1", and trials for playback.
struct Evaluated {
  json entries = json::array();
  std::vector<physics::Recording> recordings;
};

std::string level_text(const json& margin, const char* unit) {
  if (margin["level"].is_null()) return fmt::format("fails at {:g}{}", margin["easy"].get<double>(), unit);
  const double level = margin["level"];
  return fmt::format("{}{:.3g}{}", margin["level"] == margin["hard"] ? "beyond " : "", level, unit);
}

/// What an entry holds beside outcome and reason, a line each.
std::vector<std::string> details_of(const json& entry) {
  std::vector<std::string> lines;
  if (entry.contains("lift") && !entry["lift"].is_null())
    lines.push_back(fmt::format("lift and shake: {}, ended in '{}'{}",
                                entry["lift"]["outcome"].get<std::string>(),
                                entry["lift"]["phase"].get<std::string>(),
                                entry["lift"]["outcome"] != "held"      ? ""
                                : entry["lift"]["released"].get<bool>() ? ", fell when the hand opened"
                                                                        : ", but stuck to the open hand"));
  if (entry.contains("margins") && !entry["margins"].is_null()) {
    const json& margins = entry["margins"];
    lines.push_back(fmt::format("pose noise of 5 mm and 5 deg: held in {} of {} draws",
                                margins["held"].get<int>(), margins["draws"].get<int>()));
    lines.push_back(fmt::format("in 95 % of draws: smallest friction {}, largest push {}, largest noise {}",
                                level_text(margins["friction"], ""),
                                level_text(margins["push_m_s2"], " m/s^2"),
                                level_text(margins["noise"], " times that")));
  }
  if (entry.contains("loosening"))
    for (const json& one : entry["loosening"])
      lines.push_back(fmt::format("finger {} may open by a share of {}", one["finger"].get<std::string>(),
                                  level_text(one["share"], "")));
  if (entry.contains("summary") && entry["summary"]["worst"].is_string())
    lines.push_back(fmt::format("{} of {} pushes held, {} of them within 2 cm; the worst is {}",
                                entry["summary"]["held"].dump(), entry["summary"]["pushes"].dump(),
                                entry["summary"]["held_within_2_cm"].dump(),
                                entry["summary"]["worst"].get<std::string>()));
  if (entry.contains("a_50"))
    if (const auto half = physics::half_amplitude_from(entry["a_50"]))
      lines.push_back(fmt::format(
          "half of the random wrenches hold for 10 s at an amplitude of {} weights (a_50)", half->text()));
  for (const json& control : entry["controls"])
    if (!control["ok"].get<bool>())
      lines.push_back(fmt::format("NOT VALID: control '{}' held in {} of {} trials ({})",
                                  control["name"].get<std::string>(), control["held"].dump(),
                                  control["trials"].dump(), control["rule"].get<std::string>()));
  if (entry["self_check"]["trials"] == 0) return lines;
  lines.push_back("self-check: half step " + entry["self_check"]["agree_at_half_step"].dump() + " of " +
                  entry["self_check"]["trials"].dump() + ", twice the iterations " +
                  entry["self_check"]["agree_with_twice_iterations"].dump() + " of " +
                  entry["self_check"]["trials"].dump());
  for (const json& line : entry["self_check"]["disagreements"]) lines.push_back(line.get<std::string>());
  return lines;
}

/// What geocage-force lets one choose. ConfigurationError: out of its bounds.
stages::EvaluateParams chosen(const EvaluateOptions& options) {
  stages::EvaluateParams params;
  const pipeline::Fields fields = pipeline::fields_of(params);
  std::vector<std::string> mistakes;
  for (const pipeline::Setting& setting : options.force) {
    pipeline::apply(setting, fields, mistakes);
    if (setting.field == "density_kg_m3") params.weight = "density";
  }
  if (!mistakes.empty()) throw pipeline::ConfigurationError(std::move(mistakes));
  return params;
}

Evaluated evaluated(const std::string& protocol, const std::string& where, const EvaluateOptions& options,
                    const hands::GraspSet& grasps, const geometry::TriangleMesh& mesh,
                    const geometry::SignedDistanceField& field, const hands::Hand& hand) {
  pipeline::Run run;
  Evaluated seen;
  const auto keep = [&](const auto& all) {
    for (const auto& evaluation : all.list) {
      seen.entries.push_back(stages::to_json(all, evaluation));
      seen.entries.back()["self_check"] = physics::to_json(all.self_check);
      seen.entries.back()["controls"] = physics::to_json(all.controls);
      seen.entries.back()["valid"] = all.valid();
    }
    seen.recordings = all.recordings;
  };
  const int every = static_cast<int>(grasps.grasps.size());
  const int recorded = options.record.empty() ? 0 : every, bisected = options.margins ? every : 0;
  if (protocol == cage_protocol) {
    stages::CageParams params;
    params.object_geometry = "given";
    params.recorded_grasps = recorded, params.margin_grasps = bisected;
    keep(pipeline::contained<stages::CageEvaluations>(
        limits_of_evaluation(), where, [&] { return stages::cage(params, run, grasps, mesh, field, hand); }));
  } else {
    stages::EvaluateParams params;
    if (protocol == params.protocol) params = chosen(options);
    params.protocol = protocol;
    params.object_geometry = "given";
    params.recorded_grasps = recorded, params.lift_grasps = every, params.margin_grasps = bisected;
    keep(pipeline::contained<stages::Evaluations>(limits_of_evaluation(), where, [&] {
      return stages::evaluate(params, run, grasps, motion::TrajectorySet{}, mesh, field, hand);
    }));
  }
  return seen;
}

}  // namespace

int evaluate(const Shared& shared, const EvaluateOptions& options) {
  const auto protocols = protocols_of(options.protocol);
  const std::string own = chosen(options).protocol;
  if (!options.force.empty() && std::ranges::count(protocols, own) == 0)
    throw UserError(Fault::configuration, options.force.front().where,
                    "only geocage-force takes it: every other protocol names its own",
                    "leave it out, or add " + own + " to --protocol");
  if (options.record.has_parent_path() && !fs::is_directory(options.record.parent_path()))
    throw UserError(Fault::configuration, "--record " + options.record.string(), "its folder is not there");
  const auto hand = hands::load_hand(options.hand);
  const auto grasps = hands::read_grasps(options.grasp);
  if (hand.net)
    throw UserError(Fault::input, options.grasp.string(), "a net of points can't be evaluated",
                    "its blocked share is in the grasp's scores");
  if (grasps.grasps.empty())
    throw UserError(Fault::input, options.grasp.string(), "it holds no grasp", "give one that holds some");
  for (const auto& grasp : grasps.grasps) {
    if (grasp.hand != hand.name)
      throw UserError(Fault::input, options.grasp.string(),
                      fmt::format("it holds a grasp for the hand '{}', not '{}'", grasp.hand, hand.name),
                      "say --hand " + grasp.hand);
    hands::joint_vector(hand.tree, grasp.joints_rad, options.grasp.string());
  }
  Listener run;
  const auto mesh = closed_mesh(options.mesh, options.unit, options.decimate, run);
  if (!shared.quiet) tell(run.said);
  const std::string where = options.mesh.string() + ", " + options.grasp.string();
  const auto field = pipeline::contained<geometry::SignedDistanceField>(
      limits_of_evaluation(), where, [&] { return stages::field(stages::FieldParams{}, run, mesh); });

  int bad = 0;
  json list = json::array();
  std::vector<physics::Recording> recordings;
  for (const auto& protocol : protocols) {
    Evaluated seen = evaluated(protocol, where, options, grasps, mesh, field, hand);
    for (json& entry : seen.entries) list.push_back(std::move(entry));
    std::ranges::move(seen.recordings, std::back_inserter(recordings));
  }
  if (!options.record.empty())
    pipeline::replace_text(options.record, physics::to_json(recordings).dump() + "\n");
  for (const json& entry : list) {
    const std::string outcome = entry["outcome"], protocol = entry["protocol"], reason = entry["reason"];
    bad += outcome == "rejected" || outcome == "error" || !entry["valid"].get<bool>();
    if (!shared.json && protocols.size() == 1) fmt::print("{}: {}\n", outcome, reason);
    if (!shared.json && protocols.size() > 1)
      fmt::print("{:<14} grasp {:<3} {:<10} {}\n", protocol, entry["grasp"].get<int>(), outcome, reason);
    if (!shared.json)
      for (const std::string& line : details_of(entry)) fmt::print("  {}\n", line);
  }
  if (shared.json && list.size() == 1) print_json(list.front());
  if (shared.json && list.size() != 1)
    print_json(json{{"schema", "geocage-evaluations 1"}, {"evaluations", list}});
  return bad == 0 ? 0 : 1;
}

}  // namespace geocage::cli
