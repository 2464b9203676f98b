#pragma once
#include <string>
#include <vector>

namespace geocage::tests {

/// What a command printed and how it ended.
struct Ended {
  int code = -1;
  std::string out, err;
};

/// Runs the built program with these arguments and extra environment ("NAME=value").
Ended geocage(const std::vector<std::string>& arguments, const std::vector<std::string>& environment = {});

/// Runs a line of the shell, in which "$GEOCAGE" is the built program.
Ended geocage_in_shell(const std::string& line);

/// Starts it and kills it after `milliseconds` (SIGKILL).
void geocage_killed(const std::vector<std::string>& arguments, int milliseconds);

/// Starts it and interrupts it (SIGINT) after `milliseconds`.
Ended geocage_interrupted(const std::vector<std::string>& arguments, int milliseconds);

/// Runs it to its end, and kills (SIGKILL) `kills` of its child processes meanwhile, one at a time with
/// random pauses of at most `pause_ms`.
Ended geocage_with_workers_killed(const std::vector<std::string>& arguments, int kills, int pause_ms,
                                  unsigned seed);

}  // namespace geocage::tests
