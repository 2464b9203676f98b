#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace geocage::datasets {

enum class Ending { done, failed, not_there, too_slow };
struct ProgramResult {
  Ending ending = Ending::done;
  std::string
      complaint;  ///< empty if done; else its first line that starts with "E:" or "dpkg", or its last line
};

/// Runs a program of PATH in `folder`, without a shell, and waits. Beyond `limit_s` it is killed with its
/// children. What it prints goes to `folder`/log. std::system_error when no process can be made.
ProgramResult run_program(const std::vector<std::string>& words, const std::filesystem::path& folder,
                          double limit_s);

}  // namespace geocage::datasets
