#include "pipeline/passing_folder.h"

#include <cerrno>
#include <chrono>
#include <string>
#include <system_error>
#include <vector>

#include <fcntl.h>
#include <stdlib.h>
#include <sys/file.h>
#include <unistd.h>

namespace geocage::pipeline {

namespace fs = std::filesystem;

namespace {

constexpr const char* prefix = "geocage-passing-";

/// Opens a folder and locks it; -1 when somebody else has it locked.
int locked(const fs::path& folder) {
  const int handle = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (handle >= 0 && flock(handle, LOCK_EX | LOCK_NB) == 0) return handle;
  if (handle >= 0) close(handle);
  return -1;
}

}  // namespace

PassingFolder::PassingFolder(const fs::path& parent) {
  std::string pattern = (fs::absolute(parent) / (prefix + std::string("XXXXXX"))).string();
  if (!mkdtemp(pattern.data())) throw std::system_error(errno, std::generic_category(), pattern);
  path_ = pattern;
  lock_ = locked(path_);
}

PassingFolder::~PassingFolder() {
  if (lock_ >= 0) close(lock_);
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

void sweep_passing_folders(const fs::path& parent) {
  std::error_code error;
  const auto old =
      fs::file_time_type::clock::now() - std::chrono::minutes(1);  // a new one may not be locked yet
  std::vector<fs::path> left;
  for (fs::directory_iterator it(parent, error), end; !error && it != end; it.increment(error))
    if (it->path().filename().string().starts_with(prefix)) left.push_back(it->path());
  for (const auto& folder : left) {
    if (fs::last_write_time(folder, error) > old || error) continue;
    const int lock = locked(folder);
    if (lock < 0) continue;
    fs::remove_all(folder, error);
    close(lock);
  }
}

}  // namespace geocage::pipeline
