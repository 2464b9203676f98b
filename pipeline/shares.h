#pragma once
#include <atomic>
#include <cstddef>
#include <memory>

namespace geocage::pipeline {

/// Numbers that this process writes while its workers read them.
class Shares {
 public:
  /// `count` ones. std::system_error when there is no memory.
  explicit Shares(std::size_t count);
  std::atomic<int>& operator[](std::size_t i) { return numbers_[i]; }

 private:
  struct Unmap {
    std::size_t bytes;
    void operator()(std::atomic<int>* numbers) const;
  };
  std::unique_ptr<std::atomic<int>[], Unmap> numbers_;
};

/// From now on `for_each_item` of this process uses as many threads as `share` says, whenever that changes.
void follow(const std::atomic<int>& share);
/// What it says now, at least 1; 0 where none is followed.
int share_now();

}  // namespace geocage::pipeline
