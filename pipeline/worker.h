#pragma once
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

#include "pipeline/codec.h"
#include "pipeline/error.h"

namespace geocage::pipeline {

/// What a worker process may take before it is ended.
struct WorkerLimits {
  double seconds = 10;
  double memory_gib = 4;  ///< beyond what the process holds already
  int threads = 1;        ///< as many may use up `seconds` of processor time each
  std::string subject = "its reader";
  std::string hint = "if it is a file, it is probably broken: write it anew with another tool";
  /// Of the clock it may take so many times `seconds`. More than 1 where a lost worker is no failure but
  /// another answer: that hangs on the processor time alone then, not on what else the machine does.
  double patience = 1;
};

/// How a worker was lost.
enum class Loss { crash, timeout, memory, exception };
std::string_view word(Loss loss);

/// A worker that did not bring its value; in run_contained's words.
class WorkerLost : public UserError {
 public:
  WorkerLost(Loss loss, const std::string& where, const std::string& sentence, const std::string& hint)
      : UserError(Fault::input, where, sentence, hint), loss_(loss) {}
  Loss loss() const { return loss_; }

 private:
  Loss loss_;
};

/// What a worker took.
struct WorkerUse {
  double peak_memory_gib = 0;  ///< most that was resident at once, with what it shares with this process
};

/// Hears how far a worker is.
using HowFar = std::function<void(std::size_t done, std::size_t total)>;
/// In a worker: tells the process that waits for it, ten times a second at most; elsewhere nothing.
void tell_how_far(std::size_t done, std::size_t total);

/// Runs `work(folder)` in a child process with an empty scratch folder, then `collect(folder)` here. A crash,
/// a hang or running out of memory there is a WorkerLost here, naming `where`; a UserError or a
/// std::system_error thrown there is thrown here. `hear` gets what `work` gives to tell_how_far. The child is
/// a fork: `work` may call readers that this process never calls itself (assimp, PCL files); it may use
/// OpenMP or TBB only when this process never did. The child dies with its parent.
WorkerUse run_contained(const WorkerLimits& limits, const std::string& where,
                        const std::function<void(const std::filesystem::path&)>& work,
                        const std::function<void(const std::filesystem::path&)>& collect,
                        const HowFar& hear = {});

/// The value of `make()`, made in a worker process.
template <Artefact T>
T contained(const WorkerLimits& limits, const std::string& where, const std::function<T()>& make) {
  T value;
  run_contained(
      limits, where, [&](const std::filesystem::path& dir) { save_artefact(make(), dir); },
      [&](const std::filesystem::path& dir) { load_artefact(value, dir); });
  return value;
}

}  // namespace geocage::pipeline
