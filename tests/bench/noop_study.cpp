// How long a run takes that finds everything made: ITEMS chains of 8 slots over one store.
//   noop_study FOLDER [ITEMS]     run it twice: the first makes them, the second is the figure
#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>

#include <fmt/format.h>
#include <sys/resource.h>

#include "pipeline/pipeline.h"

namespace geocage::bench {

struct Words {
  std::string text;
};
std::string_view artefact_kind(const Words*) {
  return "words";
}
void save_artefact(const Words& value, const std::filesystem::path& dir) {
  std::ofstream(dir / "words.txt") << value.text;
}
void load_artefact(Words& value, const std::filesystem::path& dir) {
  std::getline(std::ifstream(dir / "words.txt"), value.text);
}

namespace {

struct StepParams {
  int item = 0;
  void visit(pipeline::Fields& f) { f("item", item, {0, 1e9}, ""); }
};
Words begin(const StepParams& p, pipeline::Run&) {
  return {std::to_string(p.item)};
}
Words step(const StepParams&, pipeline::Run&, const Words& before) {
  return {before.text + "+"};
}

}  // namespace
}  // namespace geocage::bench

int main(int argc, char** argv) {
  using namespace geocage;
  if (argc < 2) return 2;
  const int items = argc > 2 ? std::stoi(argv[2]) : 1000;
  const auto start = std::chrono::steady_clock::now();
  const pipeline::Store store(argv[1]);
  pipeline::Pipeline pipeline(store);
  constexpr pipeline::Stage first{"begin", 1, &bench::begin};
  constexpr pipeline::Stage next{"step", 1, &bench::step};
  for (int i = 0; i < items; ++i) {
    auto target = pipeline.add(fmt::format("{}/0", i), first, {i});
    for (int k = 1; k < 8; ++k) target = pipeline.add(fmt::format("{}/{}", i, k), next, {i}, target);
  }
  pipeline::Watcher quiet;
  int made = 0;
  for (const auto& result : pipeline.run({.jobs = 1}, quiet))
    made += result.state == pipeline::SlotState::made;
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - start;
  const auto user_s =
      static_cast<double>(used.ru_utime.tv_sec) + static_cast<double>(used.ru_utime.tv_usec) * 1e-6;
  const auto system_s =
      static_cast<double>(used.ru_stime.tv_sec) + static_cast<double>(used.ru_stime.tv_usec) * 1e-6;
  fmt::print("{} slots, {} made, {:.2f} s passed, {:.2f} s of processor, {} MB\n", items * 8, made,
             passed.count(), user_s + system_s, used.ru_maxrss / 1024);
}
