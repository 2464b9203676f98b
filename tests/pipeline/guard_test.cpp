// A guarded pipeline: what a stage does to its process is a failure of its slot alone, and is remembered.
#include <cstdlib>
#include <fstream>
#include <map>
#include <vector>

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

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
    pipeline.guard({.limits = {.seconds = 0.5, .memory_gib = 1, .subject = "the stage", .hint = ""},
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
  EXPECT_EQ(failures[0].command, "again --force 'crash/act' --only 'crash/act'");
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

}  // namespace
}  // namespace geocage::pipeline
