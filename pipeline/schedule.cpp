#include "pipeline/schedule.h"

#include <algorithm>
#include <system_error>
#include <thread>

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

}  // namespace

Schedule::Schedule(std::vector<Node*> todo, Watcher& watcher, std::function<void(Node&, Watcher&)> settle)
    : todo_(std::move(todo)), watcher_(watcher), settle_(std::move(settle)) {}

void Schedule::run(int jobs) {
  {
    std::vector<std::jthread> others;
    for (int i = 1; i < jobs; ++i) others.emplace_back([this] { work(); });
    work();
  }
  if (trouble_) std::rethrow_exception(trouble_);
}

Node* Schedule::next_ready() const {
  const auto settled = [this](const Node* input) { return input->constant || ended_.contains(input); };
  const auto ready = [&](const Node* node) {
    return !taken_.contains(node) && std::all_of(node->inputs.begin(), node->inputs.end(), settled);
  };
  const auto it = std::find_if(todo_.begin(), todo_.end(), ready);
  return it == todo_.end() ? nullptr : *it;
}

void Schedule::work() {
  std::unique_lock lock(mutex_);
  while (!trouble_ && taken_.size() < todo_.size()) {
    Node* node = next_ready();
    if (!node) {
      changed_.wait(lock);
      continue;
    }
    taken_.insert(node);
    node->result.sentence = lost_input(*node);
    if (node->result.sentence.empty()) {
      watcher_.started(node->slot, ended_.size(), todo_.size());
      lock.unlock();
      settle(*node);
      lock.lock();
    }
    ended_.insert(node);
    if (!trouble_) watcher_.ended(node->result, ended_.size(), todo_.size());
    changed_.notify_all();
  }
  changed_.notify_all();
}

void Schedule::settle(Node& node) {
  const auto fail = [&](std::string sentence) {
    node.result.state = SlotState::failed;
    node.result.sentence = std::move(sentence);
  };
  try {
    settle_(node, *this);
  } catch (const UserError& error) {
    fail(error.what());
  } catch (const std::system_error&) {
    const std::lock_guard lock(mutex_);
    trouble_ = std::current_exception();
  } catch (const std::exception& error) {
    fail(std::string("error: the stage failed: ") + error.what());
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
