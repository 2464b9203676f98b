#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "cli/flow.h"

namespace geocage::cli {

/// What every command understands.
struct Shared {
  std::filesystem::path store, out = "report";
  bool json = false, quiet = false;
};

// Each command prints to stdout, speaks to stderr, and answers the exit code. Mistakes are UserErrors.

struct RunOptions {
  FlowRequest flow;
  pipeline::Wish wish;
  bool dry_run = false, retry_failed = false, single_file = false;
  double stage_seconds = 3600;  ///< a slot that takes longer fails
  double stage_memory_gib = 4;  ///< a slot that takes more fails
  int pictures = 200;           ///< of so many pairs at most
};
int run(const Shared& shared, const RunOptions& options);
int status(const Shared& shared, const FlowRequest& flow);
int why(const Shared& shared, const FlowRequest& flow, const std::string& slot);
int show(const Shared& shared, const FlowRequest& flow, const std::string& slot);
/// Metrics of all slots of the store that match a pattern, as CSV.
int metrics(const Shared& shared, const std::string& pattern);
int graph(const Shared& shared, const FlowRequest& flow);
int report(const Shared& shared, const FlowRequest& flow, bool single_file, int pictures);
/// The ledger: what failed, why, and what to type to see it again.
int failures(const Shared& shared);
/// A select statement over results.sqlite of a run.
struct QueryOptions {
  std::string statement;
  std::filesystem::path database;  ///< empty: results.sqlite in the folder of the report
  bool csv = false;
};
int query(const Shared& shared, const QueryOptions& options);
int verify(const Shared& shared);
int collect_garbage(const Shared& shared, bool dry_run);

int list_stages(const Shared& shared);
int list_params(const Shared& shared, const std::string& stage);
int list_hands(const Shared& shared, const std::filesystem::path& pictures);
int check_hand(const Shared& shared, const std::string& path);
int list_datasets(const Shared& shared);
int check_datasets(const Shared& shared);
int get_dataset(const Shared& shared, const std::string& name);

struct ScoreOptions {
  std::filesystem::path mesh, out;
  double radius_m = 0;
  std::string metric = "hop", unit = "m";
  int decimate = 0;  ///< to so many faces, meshes of more than ten million
};
int score(const Shared& shared, const ScoreOptions& options);

struct WritheOptions {
  std::filesystem::path a, b;
  bool closed = false;
};
int writhe(const Shared& shared, const WritheOptions& options);

struct ViewOptions {
  std::vector<std::filesystem::path> files;
  std::string unit = "m", hand;
};
int view(const Shared& shared, const ViewOptions& options);

/// Searches the motion that a scene asks for (docs/planning.md) and proves it free. 1 where it is not.
int plan(const Shared& shared, const std::filesystem::path& scene);

struct EvaluateOptions {
  std::filesystem::path mesh, grasp, record;  ///< record: a file for playback, or none
  std::string hand, protocol = "geocage-force", unit = "m";
  std::vector<pipeline::Setting> force;  ///< of the stage evaluate, for geocage-force alone
  bool margins = false;                  ///< bisected, too
  int decimate = 0;                      ///< to so many faces, meshes of more than ten million
};
int evaluate(const Shared& shared, const EvaluateOptions& options);

}  // namespace geocage::cli
