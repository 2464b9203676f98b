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

void Schedule::run(int jobs, double memory_gib) {
  memory_gib_ = memory_gib > 0 ? memory_gib : 0.8 * machine_memory_gib();
  {
    std::vector<std::jthread> others;
    for (int i = 1; i < jobs; ++i) others.emplace_back([this] { work(); });
    work();
  }
  if (trouble_) std::rethrow_exception(trouble_);
}

/// The first that is ready and fits into the memory that is left.
Node* Schedule::take_ready() {
  const auto fits = [&](std::size_t i) {
    return used_gib_ == 0 || used_gib_ + todo_[i]->memory_gib <= memory_gib_;
  };
  const auto it = std::ranges::find_if(ready_, fits);
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

void Schedule::work() {
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
      lock.unlock();
      settle(*node);
      lock.lock();
    }
    release(*node);
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
