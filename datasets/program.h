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

/// While one lives, an interrupt is put off, so that what was begun is cleared away first.
class PutOff {
 public:
  PutOff();
  ~PutOff();
  PutOff(const PutOff&) = delete;
  PutOff& operator=(const PutOff&) = delete;
};

/// For a handler of signals: ends the program that runs, and answers whether anything is put off; `signal` is
/// raised again once nothing is. False at the second time.
bool break_off(int signal);

/// Runs a program of PATH in `folder`, without a shell, one at a time, and waits. Beyond `limit_s` it is
/// killed with its children. What it prints goes to `folder`/log. std::system_error when no process can be
/// made.
ProgramResult run_program(const std::vector<std::string>& words, const std::filesystem::path& folder,
                          double limit_s);

}  // namespace geocage::datasets
