#include "tests/defects/trial.h"

#include <algorithm>
#include <chrono>

#include "geometry/mesh_files.h"
#include "pipeline/error.h"
#include "tests/defects/solid_oracle.h"

namespace geocage::tests {

Trial try_defect(const Mutator& mutator, geometry::TriangleMesh mesh, std::uint64_t seed,
                 const geometry::RepairParams& params) {
  Trial trial;
  trial.mutator = mutator.name;
  trial.seed = seed;
  const double diagonal_m = check_mesh(mesh).diagonal_m();
  mutator.apply(mesh, seed);
  const auto start = std::chrono::steady_clock::now();
  const geometry::Repair repair = repair_mesh(mesh, params);
  trial.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  trial.outcome = to_string(repair.outcome);
  trial.reason = repair.reason;
  if (repair.outcome == geometry::RepairOutcome::rejected) {
    trial.good = !repair.reason.empty();
    return trial;
  }
  const std::string objection = objection_of_cgal(repair.mesh);
  trial.good = objection.empty();
  if (!trial.good) trial.reason = "not a solid: " + objection;
  trial.moved = std::max(repair.lost_m, repair.added_m) / diagonal_m;
  try {
    geometry::guard_units(mutator.name, check_mesh(repair.mesh).diagonal_m());
  } catch (const pipeline::UserError& error) {
    trial.outcome = "rejected";
    trial.reason = error.sentence();
  }
  return trial;
}

}  // namespace geocage::tests
