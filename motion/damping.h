#pragma once
#include <algorithm>
#include <vector>

#include <Eigen/Core>

namespace geocage::motion {

/// Damping of a search (Levenberg 1944): ten times as much after a step that did not help, a fifth after one
/// that did. None stays none until a step fails.
class Damping {
 public:
  explicit Damping(double first) : value_(first) {}
  double value() const { return value_; }
  void failed() { value_ = std::min(most, std::max(value_, least) * 10); }
  void helped() { value_ = value_ == 0 ? 0 : std::max(least, value_ / 5); }

 private:
  static constexpr double least = 1e-12, most = 1e8;
  double value_;
};

/// Largest change of a coordinate between two paths of one length.
inline double largest_move(const std::vector<Eigen::VectorXd>& a, const std::vector<Eigen::VectorXd>& b) {
  double most = 0;
  for (std::size_t t = 0; t < a.size(); ++t) most = std::max(most, (a[t] - b[t]).lpNorm<Eigen::Infinity>());
  return most;
}

}  // namespace geocage::motion
