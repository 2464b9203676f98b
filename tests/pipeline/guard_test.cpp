// A guarded pipeline: what a stage does to its process is a failure of its slot alone, and is remembered.
#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <fstream>
#include <map>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "pipeline/each_item.h"
#include "pipeline/ledger.h"
#include "pipeline/pipeline.h"
#include "tests/pipeline/scratch_folder.h"

namespace geocage::pipeline {

struct Deed {
  std::string text;
};
std::string_view artefact_kind(const Deed*) {
  return "deed";
}
void save_artefact(const Deed& value, const std::filesystem::path& dir) {
  std::ofstream(dir / "deed.txt") << value.text;
}
void load_artefact(Deed& value, const std::filesystem::path& dir) {
  std::getline(std::ifstream(dir / "deed.txt"), value.text);
}

namespace {

struct DeedParams {
  std::string deed = "good";
  void visit(Fields& f) { f("deed", deed, {}, ""); }
};
Deed act(const DeedParams& p, Run& run) {
  run.log("acting");
  run.metric("third", 1.0 / 3);
  if (p.deed == "crash") std::abort();
  if (p.deed == "hang") pause();
  if (p.deed == "eat") return {std::string(8ull << 30, 'x')};
  if (p.deed == "throw") throw std::runtime_error("two\nlines");
  if (p.deed == "refuse") throw UserError(Fault::geometry, "act", "no");
  return {p.deed};
}
constexpr Stage act_stage{"act", 1, &act};

/// Which share of the cores it had when it began and when it ended. `wait`: not before it has `until`.
struct ShareParams {
  int until = 1;
  void visit(Fields& f) { f("until", until, {1, 64}, ""); }
};
Deed take_share(const ShareParams& p, Run& run) {
  run.metric("first", share_now());
  for (int i = 0; i < 1000 && share_now() != p.until; ++i) usleep(10'000);
  run.metric("last", share_now());
  return {};
}
constexpr Stage share_stage{"share", 1, &take_share, 1.0};

/// Slots in the order they ended.
class Listener : public Watcher {
 public:
  void log(const std::string&, std::string_view sentence) override { logged = sentence; }
  void ended(const SlotResult& result, std::size_t, std::size_t) override { order.push_back(result.slot); }
  std::string logged;
  std::vector<std::string> order;
};

class Guarded : public testing::Test {
 protected:
  std::map<std::string, SlotResult> run(const std::vector<std::string>& deeds, Wish wish = {}) {
    const Store store(folder_ / "store");
    Pipeline pipeline(store);
    pipeline.guard({.limits = {.seconds = 2, .memory_gib = 1, .subject = "the stage", .hint = ""},
                    .retry_failed = retry_,
                    .command = "again"});
    for (const auto& deed : deeds) pipeline.add(deed + "/act", act_stage, DeedParams{deed});
    std::map<std::string, SlotResult> results;
    for (auto& result : pipeline.run(wish, listener_)) results[result.slot] = result;
    return results;
  }
  tests::ScratchFolder folder_;
  Listener listener_;
  bool retry_ = false;
};

TEST_F(Guarded, EachLossHasItsCodeAndTheOthersAreMade) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "the address sanitizer has no limit of memory";
#endif
  const auto results = run({"crash", "hang", "eat", "throw", "refuse", "good"}, {.jobs = 2});
  EXPECT_EQ(results.at("crash/act").code, "crash");
  EXPECT_EQ(results.at("hang/act").code, "timeout");
  EXPECT_EQ(results.at("eat/act").code, "out_of_memory");
  EXPECT_EQ(results.at("throw/act").code, "exception");
  EXPECT_EQ(results.at("refuse/act").code, "geometry");
  EXPECT_EQ(results.at("good/act").state, SlotState::made);
  EXPECT_EQ(results.at("good/act").metrics.at("third"), 1.0 / 3);  // the same bits, though written as text
  EXPECT_EQ(listener_.logged, "acting");
  const auto failures = Ledger(Store(folder_ / "store")).all();
  ASSERT_EQ(failures.size(), 5u);
  EXPECT_EQ(failures[0].slot, "crash/act");
  EXPECT_EQ(failures[0].command, "again --force crash/act --only crash/act");
}

TEST_F(Guarded, AFailureIsRememberedUntilItIsAskedForAgain) {
  EXPECT_FALSE(run({"refuse"}).at("refuse/act").known);
  EXPECT_TRUE(run({"refuse"}).at("refuse/act").known);
  EXPECT_EQ(run({"refuse"}).at("refuse/act").state, SlotState::failed);
  EXPECT_FALSE(run({"refuse"}, {.force = {"refuse/act"}}).at("refuse/act").known);
  retry_ = true;
  EXPECT_FALSE(run({"refuse"}).at("refuse/act").known);
}

TEST_F(Guarded, SlotsAreTakenInTheirOrder) {
  run({"a", "b", "c"}, {.jobs = 1});
  EXPECT_EQ(listener_.order, (std::vector<std::string>{"a/act", "b/act", "c/act"}));
}

/// First and last share of slots that wait for these shares.
std::map<std::string, std::pair<double, double>> shares(const std::vector<int>& until, const Wish& wish) {
  const tests::ScratchFolder folder;
  const Store store(folder / "store");
  Pipeline pipeline(store);
  pipeline.guard(
      {.limits = {.seconds = 20}, .prepare = [](const std::atomic<int>& share) { follow(share); }});
  for (std::size_t i = 0; i < until.size(); ++i)
    pipeline.add(std::string(1, static_cast<char>('a' + i)), share_stage, ShareParams{until[i]});
  Watcher quiet;
  std::map<std::string, std::pair<double, double>> seen;
  for (const auto& one : pipeline.run(wish, quiet))
    seen[one.slot] = {one.metrics.at("first"), one.metrics.at("last")};
  return seen;
}

TEST(Shares, OneAloneHasAllCores) {
  EXPECT_EQ(shares({5}, {.jobs = 3, .cores = 5}).at("a"), std::pair(5.0, 5.0));
  EXPECT_EQ(shares({5, 5}, {.jobs = 1, .cores = 5}).at("a"), std::pair(5.0, 5.0));
}

// Each begins with its part, though the others begin a moment later; the last one has what they leave.
TEST(Shares, TheLastOneGetsTheCoresOfThoseThatEnded) {
  const auto seen = shares({5, 2}, {.jobs = 2, .cores = 5});
  EXPECT_EQ(seen.at("b"), std::pair(2.0, 2.0));
  EXPECT_EQ(seen.at("a").second, 5);
}

// A slot declares 1 GiB: two don't fit beside each other, so the one has all cores at once.
TEST(Shares, OnesThatDoNotFitIntoMemoryDoNotCount) {
  EXPECT_EQ(shares({4, 4}, {.jobs = 2, .memory_gib = 1.5, .cores = 4}).at("a"), std::pair(4.0, 4.0));
}

// More jobs than cores: one core each, never none.
TEST(Shares, NobodyHasNone) {
  EXPECT_EQ(shares({1, 1, 1}, {.jobs = 3, .cores = 2}).at("c"), std::pair(1.0, 1.0));
}

TEST(Shares, EachItemIsDoneOnceWhileTheShareChanges) {
  const pid_t worker = fork();  // this process follows no share, and starts no threads
  if (worker == 0) {
    Shares share(1);
    follow(share[0]);
    std::vector<std::atomic<int>> done(500);
    std::jthread changer([&](const std::stop_token& stop) {
      for (int i = 0; !stop.stop_requested(); ++i, usleep(300)) share[0] = 1 + i % 3;
    });
    for_each_item(done.size(), [&](std::size_t i) {
      usleep(200);
      ++done[i];
    });
    _exit(std::ranges::all_of(done, [](const auto& times) { return times == 1; }) ? 0 : 1);
  }
  int status = 0;
  waitpid(worker, &status, 0);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
}

}  // namespace
}  // namespace geocage::pipeline
