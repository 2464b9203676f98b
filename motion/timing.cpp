#include "motion/timing.h"

#include <algorithm>
#include <cmath>

namespace geocage::motion {

using Eigen::VectorXd;
using Path = std::vector<VectorXd>;

namespace {

/// The move of step t, none before the first and after the last.
VectorXd move_of(const Path& path, std::ptrdiff_t t) {
  if (t < 0 || t + 1 >= static_cast<std::ptrdiff_t>(path.size())) return VectorXd::Zero(path.front().size());
  return path[static_cast<std::size_t>(t) + 1] - path[static_cast<std::size_t>(t)];
}

/// By how much the least time of a step or the largest acceleration at a waypoint exceeds what is allowed.
double excess(const VectorXd& change, const VectorXd& limit) {
  double most = 0;
  for (Eigen::Index i = 0; i < change.size(); ++i)
    if (limit[i] > 0) most = std::max(most, std::abs(change[i]) / limit[i]);
  return most;
}

/// Durations of the steps that keep speeds, and accelerations between the middles of neighbouring steps.
std::vector<double> durations(const Path& path, const MotionLimits& limits) {
  const std::size_t n = path.size() - 1;
  std::vector<double> h(n);
  std::vector<VectorXd> moves(n);
  double longest = 1e-6;
  for (std::size_t t = 0; t < n; ++t) {
    moves[t] = path[t + 1] - path[t];
    longest = std::max(longest, h[t] = excess(moves[t], limits.speed));
  }
  for (double& step : h) step = std::max(step, 1e-3 * longest);
  for (int round = 0; round < 200; ++round) {
    bool kept = true;
    for (std::size_t t = 0; t <= n; ++t) {
      const VectorXd before = t > 0 ? VectorXd(moves[t - 1] / h[t - 1]) : VectorXd::Zero(path[0].size()),
                     after = t < n ? VectorXd(moves[t] / h[t]) : VectorXd::Zero(path[0].size());
      const double time = ((t > 0 ? h[t - 1] : 0) + (t < n ? h[t] : 0)) / 2;
      const double ratio = excess(after - before, limits.acceleration) / time;
      if (ratio <= 1.001) continue;
      kept = false;
      const double stretch = std::min(std::sqrt(ratio), 1.2);
      // The faster side gives way.
      const bool first = t == n || (t > 0 && before.norm() > after.norm());
      (first ? h[t - 1] : h[t]) *= stretch;
    }
    if (kept) break;
  }
  return h;
}

}  // namespace

double shortest_step_s(const Path& path, const MotionLimits& limits) {
  double dt = 1e-3;
  for (std::ptrdiff_t t = 0; t <= static_cast<std::ptrdiff_t>(path.size()) - 1; ++t) {
    const VectorXd move = move_of(path, t);
    dt = std::max(dt, excess(move, limits.speed));
    dt = std::max(dt, std::sqrt(excess(move - move_of(path, t - 1), limits.acceleration)));
  }
  return dt;
}

Respaced evened_in_time(const Path& path, const MotionLimits& limits) {
  const std::size_t n = path.size() - 1;
  const auto h = durations(path, limits);
  // u(t): which waypoint at what time; slopes du/dt by harmonic means keep it monotone.
  std::vector<double> time(n + 1, 0), slope(n + 1, 0);
  for (std::size_t t = 0; t < n; ++t) time[t + 1] = time[t] + h[t];
  for (std::size_t t = 1; t < n; ++t) slope[t] = 2 / (h[t - 1] + h[t]);
  Respaced even;
  std::size_t at = 0;
  for (std::size_t k = 0; k <= n; ++k) {
    const double now = time[n] * static_cast<double>(k) / static_cast<double>(n);
    while (at + 1 < n && time[at + 1] <= now) ++at;
    const double s = std::clamp((now - time[at]) / h[at], 0.0, 1.0), s2 = s * s, s3 = s2 * s;
    double u = static_cast<double>(at) + (3 * s2 - 2 * s3) +
               h[at] * ((s3 - 2 * s2 + s) * slope[at] + (s3 - s2) * slope[at + 1]);
    u = std::clamp(u, 0.0, static_cast<double>(n));
    if (k == 0) u = 0;
    if (k == n) u = static_cast<double>(n);
    const auto i = std::min(static_cast<std::size_t>(u), n - 1);
    even.place.push_back(u);
    even.path.push_back(path[i] + (u - static_cast<double>(i)) * (path[i + 1] - path[i]));
  }
  even.path.front() = path.front();
  even.path.back() = path.back();
  return even;
}

Efficiency efficiency_of(const Path& path, double step_s) {
  Efficiency e;
  e.duration_s = step_s * static_cast<double>(path.size() - 1);
  VectorXd acceleration_before = VectorXd::Zero(path.front().size());
  for (std::ptrdiff_t t = 0; t <= static_cast<std::ptrdiff_t>(path.size()); ++t) {
    const VectorXd move = move_of(path, t);
    e.length += move.norm();
    const VectorXd acceleration = (move - move_of(path, t - 1)) / (step_s * step_s);
    e.effort += acceleration.squaredNorm() * step_s;
    e.smoothness += ((acceleration - acceleration_before) / step_s).squaredNorm() * step_s;
    acceleration_before = acceleration;
  }
  return e;
}

}  // namespace geocage::motion
