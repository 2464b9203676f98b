// What a run has published survives whatever happens to the process.
#include <chrono>
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
    const json answer = json::parse(ended.out);
    for (const auto& slot : answer["slots"])
      found[slot["slot"]] = std::filesystem::path(slot["folder"].get<std::string>()).filename();
    return found;
  }
  ScratchFolder folder_;
  std::filesystem::path flow_ = quick_flow(folder_);
};

TEST_F(StoreFaults, KilledAtTwentyRandomMoments) {
  const auto start = std::chrono::steady_clock::now();
  const auto expected = contents("calm");
  const auto whole =
      std::chrono::duration_cast<std::chrono::milliseconds>(std::chrono::steady_clock::now() - start);
  std::mt19937 random(3);
  std::uniform_int_distribution<int> moment(0, std::max(1, static_cast<int>(whole.count()) / 2));
  for (int i = 0; i < 20; ++i) geocage_killed(arguments("killed"), moment(random));
  EXPECT_EQ(contents("killed"), expected);
  EXPECT_EQ(geocage({"verify", "--store", (folder_ / "killed").string()}).code, 0);
  EXPECT_TRUE(std::filesystem::is_empty(folder_ / "killed" / "tmp"));
}

TEST_F(StoreFaults, TwoRunsAtOnceMakeEachStageOnce) {
  std::map<std::string, int> made;
  std::mutex mutex;
  const auto run = [&] {
    const Ended ended = geocage(arguments("shared"));
    const json answer = json::parse(ended.out);
    const std::lock_guard lock(mutex);
    for (const auto& slot : answer["slots"]) made[slot["slot"]] += slot["state"] == "made";
  };
  { std::jthread a(run), b(run); }
  EXPECT_FALSE(made.empty());
  for (const auto& [slot, times] : made) EXPECT_EQ(times, 1) << slot;
}

}  // namespace
}  // namespace geocage::tests
