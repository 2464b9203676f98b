#include "pipeline/worker.h"

#include <atomic>
#include <fstream>
#include <vector>

#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include "pipeline/error.h"

namespace geocage::pipeline {
namespace {

using Work = std::function<void(const std::filesystem::path&)>;
const Work nothing = [](const std::filesystem::path&) {};

/// The sentence of what went wrong in the worker.
std::string sentence_of(const Work& work, WorkerLimits limits = {5, 1}) {
  try {
    run_contained(limits, "broken.ply", work, nothing);
  } catch (const UserError& error) {
    EXPECT_EQ(error.where(), "broken.ply");
    return error.sentence();
  }
  return "";
}

TEST(Worker, HandsOverWhatItWrote) {
  std::string text;
  run_contained(
      {5, 1}, "x", [](const auto& dir) { std::ofstream(dir / "value") << "42"; },
      [&](const auto& dir) { std::ifstream(dir / "value") >> text; });
  EXPECT_EQ(text, "42");
}

TEST(Worker, CrashIsASentence) {
  EXPECT_NE(sentence_of([](const auto&) { raise(SIGSEGV); }).find("crashed"), std::string::npos);
  EXPECT_NE(sentence_of([](const auto&) { abort(); }).find("crashed"), std::string::npos);
}

TEST(Worker, HangIsEnded) {
  EXPECT_NE(sentence_of(
                [](const auto&) {
                  for (;;) pause();
                },
                {0.2, 1})
                .find("did not end"),
            std::string::npos);
  EXPECT_NE(sentence_of(
                [](const auto&) {
                  for (std::atomic<int> i = 0;; ++i) {
                  }
                },
                {0.2, 1})
                .find("did not end"),
            std::string::npos);
}

TEST(Worker, MemoryIsBounded) {
  const auto glutton = [](const std::filesystem::path&) {
    std::vector<std::vector<char>> kept;
    for (;;) kept.emplace_back(100 << 20, 'x');
  };
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "no address-space limit under the address sanitizer";
#endif
  EXPECT_NE(sentence_of(glutton, {20, 0.5}).find("GiB"), std::string::npos);
}

TEST(Worker, ItsErrorsArriveWhole) {
  try {
    run_contained(
        {5, 1}, "x",
        [](const auto&) { throw UserError(Fault::configuration, "a.ply:3", "vertex 3 is NaN", "mend it"); },
        nothing);
    FAIL();
  } catch (const UserError& error) {
    EXPECT_EQ(error.fault(), Fault::configuration);
    EXPECT_STREQ(error.what(), "a.ply:3: error: vertex 3 is NaN (mend it)");
  }
  EXPECT_NE(sentence_of([](const auto&) { throw std::runtime_error("odd header"); }).find("odd header"),
            std::string::npos);
}

}  // namespace
}  // namespace geocage::pipeline
