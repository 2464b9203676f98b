#include "pipeline/schedule.h"

#include <algorithm>
#include <thread>

#include <unistd.h>

namespace geocage::pipeline {

namespace {

/// Why a node can't be made: the first input that has no value.
std::string lost_input(const Node& node) {
  for (const Node* input : node.inputs) {
    if (input->content) continue;
    const bool failed = input->result.state == SlotState::failed;
    return failed ? "needs " + input->slot + ", which failed" : input->result.sentence;
  }
  return "";
}

double machine_memory_gib() {
  return static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGESIZE)) /
         (1ull << 30);
}

}  // namespace

Schedule::Schedule(std::vector<Node*> todo, Watcher& watcher, std::function<void(Node&, Watcher&)> settle)
    : todo_(std::move(todo)),
      watcher_(watcher),
      settle_(std::move(settle)),
      waits_(todo_.size()),
      needed_by_(todo_.size()) {
  for (std::size_t i = 0; i < todo_.size(); ++i) index_[todo_[i]] = i;
  for (std::size_t i = 0; i < todo_.size(); ++i) {
    for (const Node* input : todo_[i]->inputs) {
      if (input->constant) continue;
      needed_by_[index_.at(input)].push_back(i);
      ++waits_[i];
    }
    if (waits_[i] == 0) ready_.insert(i);
  }
}

void Schedule::run(int jobs, double memory_gib, int cores) {
  memory_gib_ = memory_gib > 0 ? memory_gib : 0.8 * machine_memory_gib();
  jobs_ = static_cast<std::size_t>(std::max(1, jobs));
  cores_ = static_cast<std::size_t>(std::max(1, cores));
  shares_.emplace(jobs_);
  {
    std::vector<std::jthread> others;
    for (std::size_t lane = 1; lane < jobs_; ++lane) others.emplace_back([this, lane] { work(lane); });
    work(0);
  }
  if (trouble_) std::rethrow_exception(trouble_);
}

/// Whether so much more memory may be used beside `others`; alone everything may begin.
bool Schedule::fits(double more_gib, std::size_t others) const {
  return others == 0 || used_gib_ + more_gib <= memory_gib_;
}

/// The cores among those that are made and those that will be in a moment.
void Schedule::share_out() {
  std::size_t sharers = at_work_.size();
  double more_gib = 0;
  for (auto it = ready_.begin(); it != ready_.end() && sharers < jobs_; ++it) {
    const double its_gib = todo_[*it]->memory_gib;
    if (!fits(more_gib + its_gib, sharers)) continue;
    more_gib += its_gib;
    ++sharers;
  }
  for (std::size_t k = 0; k < at_work_.size(); ++k)
    (*shares_)[at_work_[k]] =
        static_cast<int>(std::max<std::size_t>(1, cores_ / sharers + (k < cores_ % sharers)));
}

/// The first that is ready and fits into the memory that is left.
Node* Schedule::take_ready() {
  const auto it = std::ranges::find_if(
      ready_, [&](std::size_t i) { return fits(todo_[i]->memory_gib, taken_ - ended_); });
  if (it == ready_.end()) return nullptr;
  Node* node = todo_[*it];
  ready_.erase(it);
  ++taken_;
  used_gib_ += node->memory_gib;
  return node;
}

void Schedule::release(const Node& node) {
  used_gib_ -= node.memory_gib;
  if (taken_ == ended_ + 1) used_gib_ = 0;  // sums of budgets may round
  ++ended_;
  for (std::size_t i : needed_by_[index_.at(&node)])
    if (--waits_[i] == 0) ready_.insert(i);
}

void Schedule::work(std::size_t lane) {
  std::unique_lock lock(mutex_);
  while (!trouble_ && taken_ < todo_.size()) {
    Node* node = take_ready();
    if (!node) {
      changed_.wait(lock);
      continue;
    }
    node->result.sentence = lost_input(*node);
    if (node->result.sentence.empty()) {
      watcher_.started(node->slot, ended_, todo_.size());
      node->share = &(*shares_)[lane];
      at_work_.push_back(lane);
      share_out();
      lock.unlock();
      settle(*node);
      lock.lock();
      std::erase(at_work_, lane);
    }
    release(*node);
    share_out();
    if (!trouble_) watcher_.ended(node->result, ended_, todo_.size());
    changed_.notify_all();
  }
  changed_.notify_all();
}

/// What is no failure of the node's own ends the run.
void Schedule::settle(Node& node) {
  try {
    settle_(node, *this);
  } catch (...) {
    const std::lock_guard lock(mutex_);
    trouble_ = std::current_exception();
  }
}

void Schedule::log(const std::string& slot, std::string_view sentence) {
  const std::lock_guard lock(mutex_);
  watcher_.log(slot, sentence);
}
void Schedule::progress(const std::string& slot, std::size_t done, std::size_t total) {
  const std::lock_guard lock(mutex_);
  watcher_.progress(slot, done, total);
}

}  // namespace geocage::pipeline
