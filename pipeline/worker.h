#pragma once
#include <filesystem>
#include <functional>
#include <string>

#include "pipeline/codec.h"

namespace geocage::pipeline {

/// What a worker process may take before it is ended.
struct WorkerLimits {
  double seconds = 10;
  double memory_gib = 4;  ///< beyond what the process holds already
};

/// Runs `work(folder)` in a child process with an empty scratch folder, then `collect(folder)` here. A crash,
/// a hang or running out of memory there is a UserError (Fault::input) here, naming `where`; so is a
/// UserError thrown there. The child is a fork: `work` may call readers that this process never calls itself
/// (assimp, PCL files), and must not use OpenMP, TBB or logging. The child dies with its parent.
void run_contained(const WorkerLimits& limits, const std::string& where,
                   const std::function<void(const std::filesystem::path&)>& work,
                   const std::function<void(const std::filesystem::path&)>& collect);

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
