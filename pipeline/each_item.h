#pragma once
#include <algorithm>
#include <atomic>
#include <cstddef>

#include <omp.h>

#include "pipeline/shares.h"

namespace geocage::pipeline {

/// work(i) for each i below `count`, taken in this order, on the threads that there are: of OpenMP, or of the
/// share that is followed. When that changes, each thread ends what it has begun, and the others go on. For
/// work of milliseconds and more; it must not throw, and what it does must not depend on the thread.
template <class Work>
void for_each_item(std::size_t count, const Work& work) {
  std::atomic<std::size_t> next = 0;
  while (next < count) {
    const int share = share_now();
    const auto most = static_cast<std::size_t>(share > 0 ? share : omp_get_max_threads());
    const int team = static_cast<int>(std::min(most, count));
#pragma omp parallel num_threads(team)
    while (share_now() == share) {
      const std::size_t i = next++;
      if (i >= count) break;
      work(i);
    }
  }
}

}  // namespace geocage::pipeline
