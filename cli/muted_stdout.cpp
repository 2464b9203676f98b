#include "cli/muted_stdout.h"

#include <cstdio>

#include <fcntl.h>
#include <unistd.h>

namespace geocage::cli {

MutedStdout::MutedStdout() {
  std::fflush(stdout);
  kept_ = fcntl(STDOUT_FILENO, F_DUPFD_CLOEXEC, 3);
  const int nowhere = open("/dev/null", O_WRONLY | O_CLOEXEC);
  dup2(nowhere, STDOUT_FILENO);
  close(nowhere);
}

MutedStdout::~MutedStdout() {
  std::fflush(stdout);
  dup2(kept_, STDOUT_FILENO);
  close(kept_);
}

}  // namespace geocage::cli
