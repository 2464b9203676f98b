#include "datasets/program.h"

#include <atomic>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <fstream>
#include <string_view>
#include <system_error>

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

namespace geocage::datasets {

namespace fs = std::filesystem;

namespace {

// A handler of signals reads and writes these, so they may take no lock.
std::atomic<int> put_off{0}, broken_off_by{0};
std::atomic<pid_t> running{0};
static_assert(std::atomic<pid_t>::is_always_lock_free);

/// What posix_spawn shall do in the child before the program starts.
class SpawnPlan {
 public:
  explicit SpawnPlan(const fs::path& folder) {
    posix_spawn_file_actions_init(&actions_);
    posix_spawn_file_actions_addchdir_np(&actions_, folder.c_str());
    posix_spawn_file_actions_addopen(&actions_, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&actions_, STDOUT_FILENO, "log", O_WRONLY | O_CREAT | O_TRUNC, 0600);
    posix_spawn_file_actions_adddup2(&actions_, STDOUT_FILENO, STDERR_FILENO);
    posix_spawnattr_init(&attributes_);
    posix_spawnattr_setflags(&attributes_,
                             POSIX_SPAWN_SETPGROUP);  // a group of its own, to end it as a whole
    posix_spawnattr_setpgroup(&attributes_, 0);
  }
  ~SpawnPlan() {
    posix_spawn_file_actions_destroy(&actions_);
    posix_spawnattr_destroy(&attributes_);
  }
  SpawnPlan(const SpawnPlan&) = delete;
  SpawnPlan& operator=(const SpawnPlan&) = delete;

  int spawn(pid_t& child, std::vector<char*>& words, std::vector<char*>& environment) const {
    return posix_spawnp(&child, words[0], &actions_, &attributes_, words.data(), environment.data());
  }

 private:
  posix_spawn_file_actions_t actions_{};
  posix_spawnattr_t attributes_{};
};

std::vector<char*> pointers_to(std::vector<std::string>& words) {
  std::vector<char*> pointers;
  pointers.reserve(words.size() + 1);
  for (auto& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  return pointers;
}

/// This process's environment, in English: the complaint is read by people who read the rest of our
/// sentences.
std::vector<std::string> plain_environment() {
  std::vector<std::string> environment;
  for (char** entry = environ; *entry; ++entry)
    if (!std::string_view(*entry).starts_with("LC_ALL=")) environment.emplace_back(*entry);
  environment.emplace_back("LC_ALL=C");
  return environment;
}

bool ends_in_time(pid_t child, double limit_s) {
  const int handle = static_cast<int>(syscall(SYS_pidfd_open, child, 0));
  if (handle < 0) throw std::system_error(errno, std::generic_category(), "pidfd_open");
  pollfd ended{handle, POLLIN, 0};
  int answer;
  do {
    answer = poll(&ended, 1, static_cast<int>(limit_s * 1000));
  } while (answer < 0 && errno == EINTR);
  close(handle);
  return answer > 0;
}

std::string complaint_in(const fs::path& log, const std::string& program) {
  std::ifstream in(log);
  std::string last = program + " failed and did not say why";
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with("E:") || line.starts_with("dpkg")) return line;
    if (!line.empty()) last = line;
  }
  return last;
}

}  // namespace

PutOff::PutOff() {
  ++put_off;
}
PutOff::~PutOff() {
  if (--put_off == 0 && broken_off_by != 0) raise(broken_off_by);
}

bool break_off(int signal) {
  if (put_off == 0 || broken_off_by.exchange(signal) != 0) return false;
  if (const pid_t group = running; group > 0) kill(-group, SIGKILL);
  return true;
}

ProgramResult run_program(const std::vector<std::string>& words, const fs::path& folder, double limit_s) {
  std::vector<std::string> own_words = words, environment = plain_environment();
  auto arguments = pointers_to(own_words), variables = pointers_to(environment);
  pid_t child = 0;
  const int error = SpawnPlan(folder).spawn(child, arguments, variables);
  if (error == ENOENT || error == EACCES) return {Ending::not_there, words[0] + " is not on this machine"};
  if (error != 0) throw std::system_error(error, std::generic_category(), words[0]);

  running = child;
  const bool in_time = broken_off_by == 0 && ends_in_time(child, limit_s);
  if (!in_time) kill(-child, SIGKILL);
  running = 0;
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (broken_off_by != 0) return {Ending::failed, words[0] + " was interrupted"};
  if (!in_time)
    return {Ending::too_slow, words[0] + " did not end in " + std::to_string(std::lround(limit_s)) + " s"};
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return {};
  return {Ending::failed, complaint_in(folder / "log", words[0])};
}

}  // namespace geocage::datasets
