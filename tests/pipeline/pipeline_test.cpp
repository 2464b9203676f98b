#include "pipeline/pipeline.h"

#include <atomic>
#include <fstream>
#include <random>
#include <thread>

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/pipeline/scratch_folder.h"

namespace geocage::pipeline {

// A small dataflow of texts: write -> shorten -> join.
struct Text {
  std::string text;
};
std::string_view artefact_kind(const Text*) {
  return "text";
}
void save_artefact(const Text& value, const std::filesystem::path& dir) {
  std::ofstream(dir / "text.txt") << value.text;
}
void load_artefact(Text& value, const std::filesystem::path& dir) {
  std::getline(std::ifstream(dir / "text.txt"), value.text);
}

namespace {

namespace fs = std::filesystem;

std::atomic<int> made{0};

struct WriteParams {
  std::string text = "abcdef";
  void visit(Fields& f) { f("text", text, {}, ""); }
};
Text write(const WriteParams& p, Run& run) {
  ++made;
  run.metric("letters", static_cast<double>(p.text.size()));
  if (p.text == "bad") throw UserError(Fault::geometry, "write", "bad text");
  return {p.text};
}
struct ShortenParams {
  int length = 2;
  void visit(Fields& f) { f("length", length, {0, 100}, ""); }
};
Text shorten(const ShortenParams& p, Run&, const Text& in) {
  ++made;
  std::this_thread::sleep_for(std::chrono::milliseconds(2));
  return {in.text.substr(0, static_cast<std::size_t>(p.length))};
}
struct JoinParams {
  void visit(Fields&) {}
};
Text join(const JoinParams&, Run&, const Text& a, const Text& b) {
  ++made;
  return {a.text + b.text};
}
constexpr Stage write_stage{"write", 1, &write};
constexpr Stage shorten_stage{"shorten", 1, &shorten};
constexpr Stage join_stage{"join", 1, &join};

struct Flow {
  Pipeline pipeline;
  Target<Text> written, short_one, joined;
  explicit Flow(const Store& store, const std::string& text = "abcdef", int length = 2) : pipeline(store) {
    written = pipeline.add("o/write", write_stage, WriteParams{text});
    short_one = pipeline.add("o/shorten", shorten_stage, ShortenParams{length}, written);
    joined = pipeline.add("o/join", join_stage, JoinParams{}, written, short_one);
  }
  std::string states(Wish wish = {}) {
    Watcher quiet;
    std::string text;
    for (const auto& result : pipeline.run(wish, quiet)) text += std::string(word(result.state)) + " ";
    return text;
  }
};

class PipelineTest : public testing::Test {
 protected:
  tests::ScratchFolder folder_;
  Store store_{folder_ / "store"};
};

TEST_F(PipelineTest, SecondRunMakesNothing) {
  EXPECT_EQ(Flow(store_).states(), "made made made ");
  made = 0;
  EXPECT_EQ(Flow(store_).states(), "hit hit hit ");
  EXPECT_EQ(made, 0);
}

TEST_F(PipelineTest, GetPullsWhatIsMissing) {
  Flow flow(store_);
  EXPECT_EQ(flow.pipeline.get(flow.joined)->text, "abcdefab");
}

TEST_F(PipelineTest, LateParameterRemakesOnlyWhatDependsOnIt) {
  Flow(store_).states();
  EXPECT_EQ(Flow(store_, "abcdef", 3).states(), "hit made made ");
}

TEST_F(PipelineTest, UnchangedOutputStopsTheRipple) {
  Pipeline chain(store_);
  const auto a = chain.add("p/write", write_stage, WriteParams{"abYY"});
  const auto b = chain.add("p/shorten", shorten_stage, ShortenParams{2}, a);
  chain.add("p/again", shorten_stage, ShortenParams{1}, b);
  Watcher quiet;
  chain.run({}, quiet);
  Pipeline changed(store_);
  const auto c = changed.add("p/write", write_stage, WriteParams{"abZZ"});
  const auto d = changed.add("p/shorten", shorten_stage, ShortenParams{2}, c);
  changed.add("p/again", shorten_stage, ShortenParams{1}, d);
  const auto results = changed.run({}, quiet);
  EXPECT_EQ(results[1].state, SlotState::made);
  EXPECT_EQ(results[2].state, SlotState::hit);
}

TEST_F(PipelineTest, FailureIsAResultAndStoresNothing) {
  Flow flow(store_, "bad");
  Watcher quiet;
  const auto results = flow.pipeline.run({}, quiet);
  EXPECT_EQ(results[0].state, SlotState::failed);
  EXPECT_EQ(results[0].sentence, "write: error: bad text");
  EXPECT_EQ(results[2].state, SlotState::skipped);
  EXPECT_EQ(results[2].sentence, "needs o/write, which failed");
  EXPECT_TRUE(store_.slots().empty());
  EXPECT_TRUE(fs::is_empty(store_.root() / "tmp"));
}

TEST_F(PipelineTest, OnlyUntilForce) {
  EXPECT_EQ(Flow(store_).states({.until = {"shorten"}}), "made made ");
  EXPECT_EQ(Flow(store_).states({.only = {"o/join"}}), "made ");
  EXPECT_EQ(Flow(store_).states({.force = {"o/sh*"}}), "hit made hit ");
  EXPECT_THROW(Flow(store_).states({.only = {"o/joint"}}), UserError);
}

TEST_F(PipelineTest, WhyNamesOldAndNew) {
  EXPECT_EQ(Flow(store_).pipeline.why("o/write"), "o/write: miss, it was never made\n");
  Flow(store_).states();
  Flow other(store_, "abcdef", 3);
  EXPECT_EQ(other.pipeline.why("o/shorten"),
            "o/shorten: miss, its recipe changed\n  - param length = 2\n  + param length = 3\n");
  EXPECT_NE(other.pipeline.why("o/join").find("+ param length = 3"), std::string::npos);
  other.states();
  EXPECT_EQ(other.pipeline.why("o/shorten"),
            "o/shorten: hit; it was last made anew because\n  - param length = 2\n  + param length = 3\n");
}

TEST_F(PipelineTest, StatusKnowsHitMissAndUnknown) {
  using Lines = std::vector<std::pair<std::string, std::string>>;
  EXPECT_EQ(Flow(store_).pipeline.status(),
            (Lines{{"o/write", "miss"}, {"o/shorten", "?"}, {"o/join", "?"}}));
  Flow(store_).states({.until = {"o/shorten"}});
  EXPECT_EQ(Flow(store_).pipeline.status(),
            (Lines{{"o/write", "hit"}, {"o/shorten", "hit"}, {"o/join", "miss"}}));
}

TEST_F(PipelineTest, DamagedArtefactIsMadeAnew) {
  Flow flow(store_);
  flow.states();
  const auto file = store_.folder(*flow.short_one.node->content) / "text.txt";
  fs::permissions(file, fs::perms::owner_write, fs::perm_options::add);
  std::ofstream(file) << "zz";
  EXPECT_EQ(Flow(store_).states(), "hit made hit ");
  EXPECT_TRUE(store_.verify().faults.empty());
}

TEST_F(PipelineTest, TwoRunsAtOnceMakeEachStageOnce) {
  made = 0;
  const auto run = [&] {
    const Store store(store_.root());
    Flow(store).states({.jobs = 2});
  };
  { std::jthread a(run), b(run), c(run); }
  EXPECT_EQ(made, 3);
}

// The store's promise: whenever the process dies, an undisturbed run afterwards ends with the same contents.
TEST_F(PipelineTest, KilledAtRandomMomentsLosesNothing) {
  const auto contents = [](Flow& flow) {
    return *flow.written.node->content + *flow.short_one.node->content + *flow.joined.node->content;
  };
  const Store clean(folder_ / "clean");
  Flow undisturbed(clean);
  undisturbed.states();
  std::mt19937 random(1);
  for (int round = 0; round < 20; ++round) {
    const pid_t child = fork();
    if (child == 0) {
      for (int i = 0;; ++i) Flow(store_, "text " + std::to_string(round) + std::to_string(i)).states();
    }
    usleep(std::uniform_int_distribution<>(0, 15000)(random));
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
  }
  Flow after(store_);
  EXPECT_EQ(after.states().find("failed"), std::string::npos);
  EXPECT_EQ(contents(after), contents(undisturbed));
  EXPECT_TRUE(store_.verify().faults.empty());
  store_.sweep_scratch();
  EXPECT_TRUE(fs::is_empty(store_.root() / "tmp"));
}

}  // namespace
}  // namespace geocage::pipeline
