#pragma once
#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "geometry/pose.h"
#include "hands/hand.h"

namespace geocage::reports {

/// Object-hand pairs of a run.
struct Counts {
  int in = 0, done = 0, failed = 0, rejected = 0, skipped = 0;
  bool add_up() const { return in == done + failed + rejected + skipped; }
};

/// One object with one hand. The folders are artefacts; an empty one was not made, and its part of the report
/// is left out.
struct PairInput {
  std::string object, hand;
  std::string outcome;       ///< "done", "failed", "rejected" or "skipped"
  std::string sentence;      ///< why, unless done
  std::string source;        ///< where the object comes from: package and licence, or file
  bool drawn = true;         ///< with pictures
  bool truth_known = false;  ///< the object's file is its true surface; else it is a scan
  geometry::Vec3 up_O = geometry::Vec3::UnitZ();  ///< of pictures, where the cloud knows no table
  std::filesystem::path cloud, scores, grasps, trajectories, evaluations, cages;
  std::filesystem::path occupancy, field;                   ///< for the 3-D pages alone
  std::string metric = "hop";                               ///< of the balls: "hop" or "dijkstra"
  std::string base;                                         ///< the object without the sweep's levels
  std::vector<std::pair<std::string, std::string>> levels;  ///< of the sweep: "scan.sigma_m", "0.001"
};

/// A scene with its objects; `meshes` are those of its objects, in their order.
struct SceneInput {
  std::string name;
  std::filesystem::path scene;
  std::vector<std::filesystem::path> meshes;
};

struct SlotInput {
  std::string slot, stage, state;  ///< "made", "hit", "failed" or "skipped"
  double seconds = 0;              ///< in this run
  double made_seconds = 0;         ///< when it was made
  std::filesystem::path folder;
  std::string sentence;  ///< why it failed or was skipped
  std::map<std::string, double> metrics;

  /// The metrics, and with `trials` among them `trials_per_s` of all the time that making the slot took.
  std::map<std::string, double> figures() const;
};

/// A parameter of a slot and who set it: a place in the flow file, "--set", "default" or what geocage took it
/// from.
struct ParameterInput {
  std::string name, value, from;
};

/// An entry of the ledger.
struct FailureInput {
  std::string slot, code, sentence, command;
};

/// A table of results.csv or results.sqlite. A cell is nothing, a number or a text.
struct TableInput {
  std::string name;
  std::vector<std::string> columns;
  std::vector<std::vector<std::variant<std::monostate, double, std::string>>> rows;
};

/// Names with texts, in order.
using Texts = std::vector<std::pair<std::string, std::string>>;

/// Everything a report tells that lies in no artefact.
struct ReportInput {
  std::string title;      ///< the flow's name
  std::string flow_text;  ///< the flow file as it was read
  Counts counts;
  std::vector<PairInput> pairs;
  std::vector<SceneInput> scenes;
  std::vector<SlotInput> slots;
  std::vector<std::pair<std::string, std::vector<ParameterInput>>> parameters;  ///< of each slot
  std::vector<FailureInput> failures;
  std::vector<TableInput> tables;  ///< grasps, rates, paired
  std::filesystem::path viewer;    ///< the pages' scripts; empty: not built
  std::vector<hands::Hand> hands;  ///< those that pairs name
  Texts run;                       ///< program, host, date, duration: kept out of artefacts
};

/// Writes index.html and pictures/ into `folder` (made if it isn't there) and answers the path of index.html.
/// It needs no network. With `viewer` it is the pages with 3-D views and plots, and the plain page, which
/// needs no script, is plain.html; without, index.html is the plain page and says what is missing. index.html
/// arrives last, by rename. Errors: UserError (store)
/// for a broken artefact; std::system_error when the folder can't be written.
std::filesystem::path write_report(const ReportInput& input, const std::filesystem::path& folder);

}  // namespace geocage::reports
