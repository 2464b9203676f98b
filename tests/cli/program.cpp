#include "tests/cli/program.h"

#include <fstream>
#include <random>
#include <sstream>

#include <fcntl.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/pipeline/scratch_folder.h"

namespace geocage::tests {

namespace {

pid_t start(const std::vector<std::string>& arguments, const std::vector<std::string>& environment,
            const std::filesystem::path& folder, const char* program = GEOCAGE_PROGRAM) {
  const pid_t child = fork();
  if (child != 0) return child;
  setpgid(0, 0);
  dup2(open("/dev/null", O_RDONLY), STDIN_FILENO);
  dup2(open((folder / "out").c_str(), O_WRONLY | O_CREAT, 0600), STDOUT_FILENO);
  dup2(open((folder / "err").c_str(), O_WRONLY | O_CREAT, 0600), STDERR_FILENO);
  for (const auto& variable : environment) putenv(const_cast<char*>(variable.c_str()));
  std::vector<char*> argv = {const_cast<char*>(program)};
  for (const auto& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  execv(argv[0], argv.data());
  _exit(127);
}

std::string text_of(const std::filesystem::path& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

/// Direct children, of all its threads.
std::vector<pid_t> children_of(pid_t process) {
  std::vector<pid_t> found;
  std::error_code gone;
  const std::filesystem::path tasks = "/proc/" + std::to_string(process) + "/task";
  for (std::filesystem::directory_iterator it(tasks, gone), end; !gone && it != end; it.increment(gone)) {
    std::ifstream children(it->path() / "children");
    for (pid_t child; children >> child;) found.push_back(child);
  }
  return found;
}

Ended end_of(pid_t child, const ScratchFolder& folder) {
  int status = 0;
  waitpid(child, &status, 0);
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status), text_of(folder / "out"),
          text_of(folder / "err")};
}

}  // namespace

Ended geocage(const std::vector<std::string>& arguments, const std::vector<std::string>& environment) {
  const ScratchFolder folder;
  return end_of(start(arguments, environment, folder.path()), folder);
}

Ended geocage_in_shell(const std::string& line) {
  const ScratchFolder folder;
  return end_of(start({"-c", line}, {"GEOCAGE=" GEOCAGE_PROGRAM}, folder.path(), "/bin/sh"), folder);
}

void geocage_killed(const std::vector<std::string>& arguments, int milliseconds) {
  const ScratchFolder folder;
  const pid_t child = start(arguments, {}, folder.path());
  usleep(static_cast<useconds_t>(milliseconds) * 1000);
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
}

Ended geocage_interrupted(const std::vector<std::string>& arguments, int milliseconds) {
  const ScratchFolder folder;
  const pid_t child = start(arguments, {}, folder.path());
  usleep(static_cast<useconds_t>(milliseconds) * 1000);
  kill(child, SIGINT);
  return end_of(child, folder);
}

Ended geocage_with_workers_killed(const std::vector<std::string>& arguments, int kills, int pause_ms,
                                  unsigned seed) {
  const ScratchFolder folder;
  const pid_t program = start(arguments, {}, folder.path());
  std::mt19937 random(seed);
  int status = 0;
  for (int killed = 0; waitpid(program, &status, WNOHANG) == 0;) {
    usleep(1000 * std::uniform_int_distribution<useconds_t>(0, static_cast<useconds_t>(pause_ms))(random));
    const auto children = children_of(program);
    if (killed == kills || children.empty()) continue;
    killed += kill(children[random() % children.size()], SIGKILL) == 0;
  }
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status), text_of(folder / "out"),
          text_of(folder / "err")};
}

}  // namespace geocage::tests
