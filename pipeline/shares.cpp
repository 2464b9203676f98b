#include "pipeline/shares.h"

#include <algorithm>
#include <cerrno>
#include <new>
#include <system_error>

#include <sys/mman.h>

namespace geocage::pipeline {

namespace {

static_assert(std::atomic<int>::is_always_lock_free && sizeof(std::atomic<int>) == sizeof(int));
const std::atomic<int>* followed = nullptr;

std::atomic<int>* shared_memory(std::size_t bytes) {
  void* const at = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (at == MAP_FAILED) throw std::system_error(errno, std::generic_category(), "memory of shares");
  return static_cast<std::atomic<int>*>(at);
}

}  // namespace

Shares::Shares(std::size_t count) : numbers_(shared_memory(count * sizeof(int)), Unmap{count * sizeof(int)}) {
  for (std::size_t i = 0; i < count; ++i) new (&numbers_[i]) std::atomic<int>(1);
}
void Shares::Unmap::operator()(std::atomic<int>* numbers) const {
  munmap(numbers, bytes);
}

void follow(const std::atomic<int>& share) {
  followed = &share;
}

int share_now() {
  return followed ? std::max(1, followed->load(std::memory_order_relaxed)) : 0;
}

}  // namespace geocage::pipeline
