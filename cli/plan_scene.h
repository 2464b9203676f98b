#pragma once
#include <deque>
#include <filesystem>
#include <memory>

#include "hands/arm.h"
#include "motion/certificate.h"

namespace geocage::cli {

/// A scene of `geocage plan` (docs/planning.md), ready to be searched. Nothing in it may move: tasks hold on
/// to the mover and the fields.
struct PlanScene {
  PlanScene() = default;
  PlanScene(const PlanScene&) = delete;
  PlanScene& operator=(const PlanScene&) = delete;

  hands::Hand hand;
  std::unique_ptr<hands::ArmedHand> armed;
  std::unique_ptr<motion::Mover> mover;
  std::deque<geometry::SignedDistanceField> fields;
  motion::Obstacles obstacles;
  std::vector<std::pair<int, int>> self_pairs;
  Eigen::VectorXd start;
  std::vector<motion::Task> tasks;
  int horizon = 50;
  double step_variance = 0.02;  ///< of every coordinate and step: what moves cost
  bool by_messages = true;
  double tolerance_m = 5e-4;
  double acceleration_rad_s2 = 10;
};

/// Errors (UserError, configuration; with file, line and column): what is missing, unknown or wrong.
void read_scene(const std::filesystem::path& file, PlanScene& scene);

}  // namespace geocage::cli
