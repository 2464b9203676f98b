#include "reports/statistics.h"

#include <algorithm>
#include <cmath>

namespace geocage::reports {

Proportion wilson(int hits, int trials, double z) {
  if (trials == 0) return {};
  const double n = trials, p = hits / n, shrink = 1 + z * z / n;
  const double middle = (p + z * z / (2 * n)) / shrink;
  const double half = z / shrink * std::sqrt(p * (1 - p) / n + z * z / (4 * n * n));
  return {p, std::max(0.0, middle - half), std::min(1.0, middle + half)};
}

double mcnemar(int gained, int lost) {
  const int n = gained + lost;
  double term = std::exp2(-n), tail = term;  // C(n, k) / 2^n, by recurrence
  for (int k = 1; k <= std::min(gained, lost); ++k) tail += term *= static_cast<double>(n - k + 1) / k;
  return std::min(1.0, 2 * tail);
}

}  // namespace geocage::reports
