#pragma once
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cli/objects.h"
#include "cli/parameters.h"
#include "hands/hand.h"
#include "pipeline/pipeline.h"
#include "reports/report.h"

namespace geocage::cli {

/// What the command line asks of a flow.
struct FlowRequest {
  std::optional<std::filesystem::path> file;  ///< none: the built-in flow
  std::string dataset, object, hand;          ///< empty: as the flow says
  std::vector<std::string> sets;              ///< stage.field=value
};

/// One object (of one variant) and one hand, and the slots that lead to its evaluation.
struct FlowPair {
  std::string object, hand, source;
  geometry::Vec3 up_O = geometry::Vec3::UnitZ();  ///< for pictures
  bool truth_known = false;                       ///< evaluated on the true mesh, not on the reconstruction
  std::string skipped, failed;                    ///< why there are no slots
  std::string base;                               ///< the object without its variant
  std::vector<std::pair<std::string, std::string>> levels;  ///< of the sweep: "scan.sigma_m", "0.001"
  std::vector<std::string> slots;
  std::string score_slot, agreement_slot, place_slot, approach_slot, evaluate_slot, cage_slot;
  std::string metric = "hop";  ///< of the balls

  /// There is no object to make slots for; of a scene, nobody knows what it holds.
  bool lost() const { return !skipped.empty() || !failed.empty(); }
};

struct Flow {
  std::string name, text;          ///< of the flow file
  std::vector<std::string> swept;  ///< "stage.field" of the sweep's lists
  std::vector<hands::Hand> hands;
  std::vector<FlowPair> pairs;
  /// Parameters of every slot, as text, and who set each.
  std::vector<std::pair<std::string, std::vector<reports::ParameterInput>>> parameters;
};

/// Throws what plan_flow would of the flow file, the settings and the hands, without a store.
void check_flow(const FlowRequest& request);

/// Reads the flow, resolves its objects and hands, and adds every slot to `pipeline`. The order of stages is
/// written here and nowhere else. Errors: UserError (configuration), all mistakes of a file at once.
Flow plan_flow(const FlowRequest& request, pipeline::Pipeline& pipeline);

}  // namespace geocage::cli
