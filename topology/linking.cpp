#include "topology/linking.h"

#include <cmath>

#include "topology/writhe.h"

namespace geocage::topology {

LinkingNumber linking_number(const Polyline& first, const Polyline& second) {
  double sum_sr = 0;
  for (std::size_t i = 0; i < first.size(); ++i)
    for (std::size_t j = 0; j < second.size(); ++j)
      sum_sr +=
          segment_writhe(first[i], first[(i + 1) % first.size()], second[j], second[(j + 1) % second.size()]);
  const double turns = sum_sr / (4 * M_PI), whole = std::round(turns);
  return {static_cast<int>(whole), std::abs(turns - whole)};
}

}  // namespace geocage::topology
