#include "pipeline/worker.h"

#include <atomic>
#include <chrono>
#include <fstream>
#include <latch>
#include <new>
#include <optional>
#include <thread>
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

// What else the machine does is no reason to give up: a worker that sleeps for longer than its processor time
// ends well, one that computes for longer does not.
TEST(Worker, PatienceCountsProcessorTime) {
  const WorkerLimits patient{.seconds = 0.2, .memory_gib = 1, .patience = 50};
  EXPECT_EQ(sentence_of([](const auto&) { usleep(600'000); }, patient), "");
  EXPECT_NE(sentence_of(
                [](const auto&) {
                  for (std::atomic<int> i = 0;; ++i) {
                  }
                },
                patient)
                .find("did not end within 0.2 s of processor time"),
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

/// How a worker was lost; nothing when it wasn't.
std::optional<Loss> loss_of(const Work& work, WorkerLimits limits = {5, 1}) {
  try {
    run_contained(limits, "x", work, nothing);
  } catch (const WorkerLost& lost) {
    return lost.loss();
  } catch (const UserError&) {
  }
  return {};
}

// A hint about limits would send one who reads it the wrong way.
TEST(Worker, AnExceptionIsNoMatterOfLimits) {
  const WorkerLimits limits{.hint = "the limits"};
  const auto hint_of = [&](const std::function<void(const std::filesystem::path&)>& work) {
    try {
      run_contained(limits, "x", work, nothing);
    } catch (const WorkerLost& lost) {
      return lost.hint();
    }
    return std::string();
  };
  EXPECT_EQ(hint_of([](const auto&) { throw std::runtime_error("odd"); }),
            "please report it, with the command and its input");
  EXPECT_EQ(hint_of([](const auto&) { throw std::bad_alloc(); }), "the limits");
}

// On a machine of many cores the addresses that threads take would be all that a worker may have.
TEST(Worker, ThreadsLeaveItsMemoryAlone) {
  const auto work = [](const std::filesystem::path&) {
    std::latch begun(16), over(1);
    std::vector<std::jthread> threads;
    for (int i = 0; i < 16; ++i)
      threads.emplace_back([&] {
        const std::vector<char> little(1000);
        begun.count_down();
        over.wait();
      });
    begun.wait();
    std::vector<char> block(300 << 20);
    over.count_down();
  };
  EXPECT_EQ(loss_of(work, {20, 0.5, 16}), std::nullopt);
}

TEST(Worker, LossesAreTyped) {
  EXPECT_EQ(loss_of([](const auto&) { abort(); }), Loss::crash);
  EXPECT_EQ(loss_of([](const auto&) { pause(); }, {0.2, 1}), Loss::timeout);
  EXPECT_EQ(loss_of([](const auto&) { throw std::bad_alloc(); }), Loss::memory);
  EXPECT_EQ(loss_of([](const auto&) { raise(SIGKILL); }), Loss::memory) << "as the kernel does";
  EXPECT_EQ(loss_of([](const auto&) { throw std::runtime_error("odd"); }), Loss::exception);
  // what no handler can catch: an exception that leaves a thread
  EXPECT_EQ(loss_of([](const auto&) { std::jthread([] { throw std::bad_alloc(); }).join(); }), Loss::memory);
  EXPECT_EQ(loss_of([](const auto&) { std::jthread([] { throw 1; }).join(); }), Loss::crash);
  // a worker of a worker
  EXPECT_EQ(loss_of([](const auto&) {
              run_contained(
                  {5, 1}, "y", [](const auto&) { abort(); }, nothing);
            }),
            Loss::crash);
  EXPECT_EQ(loss_of([](const auto&) { throw UserError(Fault::input, "x", "no mesh"); }), std::nullopt);
}

TEST(Worker, TellsHowFarItIsAndWhatItTook) {
  std::vector<std::size_t> heard;
  bool soon = false;
  const auto work = [](const std::filesystem::path& folder) {
    std::vector<char> block(200 << 20, 'x');  // 0.2 GiB that are touched
    tell_how_far(1, 3);
    const auto first = std::chrono::steady_clock::now();
    tell_how_far(2, 3);  // too soon after the first, unless the machine was busy meanwhile
    if (std::chrono::steady_clock::now() - first < std::chrono::milliseconds(100))
      std::ofstream(folder / "soon");
    std::this_thread::sleep_for(std::chrono::milliseconds(150));
    tell_how_far(3, 3);
    if (block[12345] != 'x') abort();
  };
  const WorkerUse use = run_contained(
      {5, 4}, "x", work, [&](const auto& folder) { soon = exists(folder / "soon"); },
      [&](std::size_t done, std::size_t) { heard.push_back(done); });
  ASSERT_FALSE(heard.empty());
  EXPECT_EQ(heard.front(), 1u);
  EXPECT_EQ(heard.back(), 3u);
  if (soon) {
    EXPECT_EQ(heard.size(), 2u);
  }
#ifndef __SANITIZE_ADDRESS__
  EXPECT_GT(use.peak_memory_gib, 0.19);
  EXPECT_LT(use.peak_memory_gib, 0.5);
#endif
  tell_how_far(1, 2);  // outside of a worker: nothing
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
