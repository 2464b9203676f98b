#pragma once
#include <condition_variable>
#include <exception>
#include <functional>
#include <mutex>
#include <set>
#include <vector>

#include "pipeline/pipeline.h"

namespace geocage::pipeline {

/// Settles nodes on several threads, inputs before what needs them. A node whose input was lost is skipped; a
/// stage that throws makes its node `failed`; std::system_error ends the whole run.
class Schedule : private Watcher {
 public:
  /// `todo` has inputs first. `settle` makes one node; it runs without the lock.
  Schedule(std::vector<Node*> todo, Watcher& watcher, std::function<void(Node&, Watcher&)> settle);
  void run(int jobs);

 private:
  void work();
  Node* next_ready() const;
  void settle(Node& node);
  void log(const std::string& slot, std::string_view sentence) override;
  void progress(const std::string& slot, std::size_t done, std::size_t total) override;

  const std::vector<Node*> todo_;
  Watcher& watcher_;  ///< called under the lock only
  const std::function<void(Node&, Watcher&)> settle_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::set<const Node*> taken_, ended_;
  std::exception_ptr trouble_;
};

}  // namespace geocage::pipeline
