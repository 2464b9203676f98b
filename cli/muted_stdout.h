#pragma once

namespace geocage::cli {

/// While it lives, what is printed to stdout goes nowhere: PCL prints to it, and stdout is for answers only.
class MutedStdout {
 public:
  MutedStdout();
  ~MutedStdout();
  MutedStdout(const MutedStdout&) = delete;
  MutedStdout& operator=(const MutedStdout&) = delete;

 private:
  int kept_;
};

}  // namespace geocage::cli
