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

/// Starts it and kills it after `milliseconds` (SIGKILL).
void geocage_killed(const std::vector<std::string>& arguments, int milliseconds);

}  // namespace geocage::tests
