#pragma once
#include <filesystem>

namespace geocage::pipeline {

/// An empty folder that goes with its scope. While it lives it is locked, and the kernel lets go of the lock
/// with the last process that has it: sweep_passing_folders knows what a killed one left.
class PassingFolder {
 public:
  /// In `parent`, which must be there. std::system_error with the path when it can't be made.
  explicit PassingFolder(const std::filesystem::path& parent = std::filesystem::temp_directory_path());
  ~PassingFolder();
  PassingFolder(const PassingFolder&) = delete;
  PassingFolder& operator=(const PassingFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
  int lock_ = -1;
};

/// Removes the passing folders in `parent` whose processes are gone.
void sweep_passing_folders(const std::filesystem::path& parent);

}  // namespace geocage::pipeline
