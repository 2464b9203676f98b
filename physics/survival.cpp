#include "physics/survival.h"

#include <algorithm>

namespace geocage::physics {

std::vector<SurvivalStep> survival(std::vector<Life> lives) {
  std::ranges::sort(lives, {}, &Life::time_s);
  std::vector<SurvivalStep> curve = {{0, 1}};
  for (std::size_t i = 0; i < lives.size();) {
    const double time = lives[i].time_s;
    const auto watched = static_cast<double>(lives.size() - i);
    int escapes = 0;
    for (; i < lives.size() && lives[i].time_s == time; ++i) escapes += lives[i].escaped;
    if (escapes > 0) curve.push_back({time, curve.back().share * (1 - escapes / watched)});
  }
  return curve;
}

double mean_held_s(const std::vector<SurvivalStep>& curve, double horizon_s) {
  double sum = 0;
  for (std::size_t i = 0; i < curve.size(); ++i) {
    const double until = i + 1 < curve.size() ? std::min(curve[i + 1].time_s, horizon_s) : horizon_s;
    sum += curve[i].share * std::max(0.0, until - curve[i].time_s);
  }
  return sum;
}

double share_at(const std::vector<SurvivalStep>& curve, double time_s) {
  double share = 1;
  for (const SurvivalStep& step : curve)
    if (step.time_s <= time_s) share = step.share;
  return share;
}

}  // namespace geocage::physics
