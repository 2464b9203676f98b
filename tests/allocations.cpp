// Replaces malloc by one that counts.
#include "tests/allocations.h"

#include <atomic>
#include <cstddef>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define GEOCAGE_COUNTS 0
#else
#define GEOCAGE_COUNTS 1
#endif

namespace {
std::atomic<long> calls{0};
}

#if GEOCAGE_COUNTS
extern "C" void* __libc_malloc(std::size_t size);
extern "C" void* malloc(std::size_t size) {
  ++calls;
  return __libc_malloc(size);
}
#endif

namespace geocage::tests {

bool allocations_are_counted() {
  return GEOCAGE_COUNTS;
}
long allocations() {
  return calls;
}

}  // namespace geocage::tests
