#include "reports/bootstrap.h"

#include <algorithm>
#include <cmath>

namespace geocage::reports {

namespace {

/// SplitMix64 (Steele, Lea, Flood 2014), whose numbers are the same everywhere.
class SplitMix {
 public:
  explicit SplitMix(std::uint64_t seed) : state_(seed) {}
  std::size_t below(std::size_t bound) { return static_cast<std::size_t>(next() % bound); }

 private:
  std::uint64_t next() {
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15ull);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
    return z ^ (z >> 31);
  }
  std::uint64_t state_;
};

struct Sum {
  double total = 0, count = 0;
  double mean() const { return count > 0 ? total / count : 0; }
  void add(const Sum& other) {
    total += other.total;
    count += other.count;
  }
};

}  // namespace

BootstrapMean bootstrap_over_groups(const std::vector<std::vector<double>>& groups, int draws,
                                    std::uint64_t seed) {
  std::vector<Sum> sums;
  Sum all;
  for (const auto& group : groups) {
    if (group.empty()) continue;
    Sum& sum = sums.emplace_back();
    for (double x : group) sum.add({x, 1});
    all.add(sum);
  }
  if (sums.size() < 2) return {.mean = all.mean()};
  SplitMix random(seed);
  std::vector<double> means;
  for (int draw = 0; draw < draws; ++draw) {
    Sum drawn;
    for (std::size_t i = 0; i < sums.size(); ++i) drawn.add(sums[random.below(sums.size())]);
    means.push_back(drawn.mean());
  }
  std::ranges::sort(means);
  const auto at = [&](double share) {
    return means[static_cast<std::size_t>(std::lround(share * (means.size() - 1)))];
  };
  return {all.mean(), at(0.025), at(0.975)};
}

}  // namespace geocage::reports
