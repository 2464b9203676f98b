#pragma once
#include <algorithm>
#include <vector>

#include <Eigen/Core>

namespace geocage::motion {

/// What to do with a step that was tried.
enum class Verdict {
  keep,
  undo,     ///< and try a shorter one
  rested,   ///< undo; the first try moved next to nothing: as good as it gets, the rise is rounding
  stalled,  ///< undo; `patience` tries in a row raised the cost, whatever the damping
};

/// Damping of a search (Levenberg 1944): ten times as much after a step that did not help, a fifth after one
/// that did. None stays none until a step fails.
class Damping {
 public:
  Damping(double first, int patience) : value_(first), patience_(patience) {}
  double value() const { return value_; }

  /// `still`: the step moved less than what counts as a move. A later try is small of damping, and never
  /// rests.
  Verdict judge(double cost, double best, bool still) {
    if (cost <= best) {
      failures_ = 0;
      value_ = value_ == 0 ? 0 : std::max(least, value_ / 5);
      return Verdict::keep;
    }
    if (still && failures_ == 0) return Verdict::rested;
    if (++failures_ == patience_) return Verdict::stalled;
    value_ = std::min(most, std::max(value_, least) * 10);
    return Verdict::undo;
  }

 private:
  static constexpr double least = 1e-12, most = 1e8;
  double value_;
  int patience_, failures_ = 0;
};

/// Largest change of a coordinate between two paths of one length.
inline double largest_move(const std::vector<Eigen::VectorXd>& a, const std::vector<Eigen::VectorXd>& b) {
  double most = 0;
  for (std::size_t t = 0; t < a.size(); ++t) most = std::max(most, (a[t] - b[t]).lpNorm<Eigen::Infinity>());
  return most;
}

}  // namespace geocage::motion
