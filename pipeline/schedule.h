#pragma once
#include <condition_variable>
#include <exception>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <vector>

#include "pipeline/pipeline.h"
#include "pipeline/shares.h"

namespace geocage::pipeline {

/// Settles nodes on several threads, inputs before what needs them. A node whose input was lost is skipped; a
/// stage that throws makes its node `failed`; std::system_error ends the whole run.
class Schedule : private Watcher {
 public:
  /// `todo` has inputs first. `settle` makes one node; it runs without the lock.
  Schedule(std::vector<Node*> todo, Watcher& watcher, std::function<void(Node&, Watcher&)> settle);
  /// At most `jobs` at a time, whose declared memory fits into `memory_gib` together (0: four fifths of the
  /// machine's); one that needs more than that runs alone. Ready nodes are taken in the order of `todo`: one
  /// object is finished before the next is begun, as far as there is work. Those that are made share `cores`
  /// (Node::share): each gets as many as all others, counting those that are about to begin, and more when
  /// there are fewer.
  void run(int jobs, double memory_gib, int cores);

 private:
  void work(std::size_t lane);
  bool fits(double more_gib, std::size_t others) const;
  void share_out();
  Node* take_ready();
  void release(const Node& node);
  void settle(Node& node);
  void log(const std::string& slot, std::string_view sentence) override;
  void progress(const std::string& slot, std::size_t done, std::size_t total) override;

  const std::vector<Node*> todo_;
  Watcher& watcher_;  ///< called under the lock only
  const std::function<void(Node&, Watcher&)> settle_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::map<const Node*, std::size_t> index_;  ///< into todo_
  std::vector<std::size_t> waits_;            ///< inputs of each node that have not ended
  std::vector<std::vector<std::size_t>> needed_by_;
  std::set<std::size_t> ready_;
  std::size_t taken_ = 0, ended_ = 0, jobs_ = 1, cores_ = 1;
  std::optional<Shares> shares_;      ///< of the cores, one a lane
  std::vector<std::size_t> at_work_;  ///< lanes in which something is made, in the order they began
  double memory_gib_ = 0, used_gib_ = 0;
  std::exception_ptr trouble_;
};

}  // namespace geocage::pipeline
