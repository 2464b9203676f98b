// What a run has published survives whatever happens to the process.
#include <chrono>
#include <cstdlib>
#include <map>
#include <mutex>
#include <random>
#include <thread>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/cli/program.h"
#include "tests/cli/shapes_folder.h"

namespace geocage::tests {
namespace {

using nlohmann::json;

class StoreFaults : public testing::Test {
 protected:
  std::vector<std::string> arguments(const std::string& store) const {
    return {"run",     flow_.string(),
            "--json",  "--quiet",
            "--store", (folder_ / store).string(),
            "--out",   (folder_ / ("report_" + store)).string()};
  }
  std::map<std::string, std::string> contents(const std::string& store) const {
    const Ended ended = geocage(arguments(store));
    EXPECT_EQ(ended.code, 0) << ended.err;
    std::map<std::string, std::string> found;
    if (ended.code != 0) return found;
    const json answer = json::parse(ended.out);
    for (const auto& slot : answer["slots"])
      found[slot["slot"]] = std::filesystem::path(slot["folder"].get<std::string>()).filename();
    return found;
  }
  ScratchFolder folder_;
  std::filesystem::path flow_ = quick_flow(folder_);
};

/// $GEOCAGE_KILLS, or so many.
int kills(int usual) {
  const char* asked = std::getenv("GEOCAGE_KILLS");
  return asked ? std::atoi(asked) : usual;
}

TEST_F(StoreFaults, KilledAtRandomMoments) {
  const auto start = std::chrono::steady_clock::now();
  const auto expected = contents("calm");
  const auto whole =
      std::chrono::duration_cast<std::chrono::milliseconds>(std::chrono::steady_clock::now() - start);
  std::mt19937 random(3);
  std::uniform_int_distribution<int> moment(0, std::max(1, static_cast<int>(whole.count()) / 2));
  for (int i = 0; i < kills(20); ++i) geocage_killed(arguments("killed"), moment(random));
  EXPECT_EQ(contents("killed"), expected);
  EXPECT_EQ(geocage({"verify", "--store", (folder_ / "killed").string()}).code, 0);
  EXPECT_TRUE(std::filesystem::is_empty(folder_ / "killed" / "tmp"));
}

// What a killed worker was to make is a failure of its slot, and can be tried again; nothing else is lost.
TEST_F(StoreFaults, WorkersKilledAtRandomMoments) {
  const auto expected = contents("calm");
  const Ended hurt = geocage_with_workers_killed(arguments("hurt"), kills(3), 150, 5);
  if (hurt.code == 1)
    EXPECT_NE(geocage({"failures", "--store", (folder_ / "hurt").string()}).out.find("out_of_memory"),
              std::string::npos);
  else
    EXPECT_EQ(hurt.code, 0) << hurt.err;  // it ended before the first kill
  for (int left = kills(3); left > 0; left -= 3) {
    auto again = arguments("hurt");
    again.insert(again.end(), {"--retry", "failed"});
    geocage_with_workers_killed(again, left > 3 ? 3 : 0, 150, 5u + static_cast<unsigned>(left));
  }
  EXPECT_EQ(contents("hurt"), expected);
  EXPECT_EQ(geocage({"verify", "--store", (folder_ / "hurt").string()}).code, 0);
}

// Under load the run may end, or not have begun, by then: an answer of 130 is looked for a few times.
TEST_F(StoreFaults, InterruptedSaysHowToGoOn) {
  Ended ended;
  for (int ms = 300; ms < 5000 && ended.code != 130; ms *= 2)
    ended = geocage_interrupted(arguments("broken_off"), ms);
  ASSERT_EQ(ended.code, 130);
  EXPECT_NE(ended.err.find("goes on from here:\n  "), std::string::npos) << ended.err;
  EXPECT_NE(ended.err.find("run " + flow_.string() + " --json"), std::string::npos) << ended.err;
  EXPECT_EQ(geocage({"verify", "--store", (folder_ / "broken_off").string()}).code, 0);
}

TEST_F(StoreFaults, TwoRunsAtOnceMakeEachStageOnce) {
  std::map<std::string, int> made;
  std::mutex mutex;
  const auto run = [&] {
    const Ended ended = geocage(arguments("shared"));
    const std::lock_guard lock(mutex);
    ASSERT_EQ(ended.code, 0) << ended.err;
    const json answer = json::parse(ended.out);
    for (const auto& slot : answer["slots"]) made[slot["slot"]] += slot["state"] == "made";
  };
  { std::jthread a(run), b(run); }
  EXPECT_FALSE(made.empty());
  for (const auto& [slot, times] : made) EXPECT_EQ(times, 1) << slot;
}

}  // namespace
}  // namespace geocage::tests
