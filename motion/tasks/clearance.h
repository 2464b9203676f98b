#pragma once
#include <memory>
#include <optional>
#include <vector>

#include "geometry/distance_field.h"
#include "motion/mover.h"
#include "motion/problem.h"

namespace geocage::motion {

/// Signed distances in O, negative inside: of a surface (geometry::build_distance_field), or of occupied and,
/// if so built, unknown cells of a map (geometry::clearance_field, whose nodes are too large by up to
/// `node_excess_m`).
struct ObstacleField {
  const geometry::SignedDistanceField* field = nullptr;
  double node_excess_m = 0;
};
/// Of a map's clearance_field, by the bound that it states.
inline ObstacleField map_obstacle(const geometry::SignedDistanceField& clearance) {
  return {&clearance, 0.37 * clearance.cell_m};
}

/// What a mover must keep away from. The fields must outlive all that uses them.
struct Obstacles {
  std::vector<ObstacleField> fields;
  std::optional<geometry::Plane> support;
};

/// Collision potential: a hinge on each ball that is nearer than margin_m[t] to an obstacle, e = max(0, 1 - d
/// / margin); a row for each ball and obstacle. The mover and the fields must outlive the task. Tasks of one
/// mover and one search may share `placed`.
Task clearance_task(const Mover& mover, const Obstacles& obstacles, std::vector<double> margin_m,
                    std::vector<double> precision,
                    std::shared_ptr<Mover::Placed> placed = std::make_shared<Mover::Placed>());

}  // namespace geocage::motion
