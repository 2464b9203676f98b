#include "pipeline/worker.h"

#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <new>
#include <system_error>

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include "pipeline/error.h"

namespace geocage::pipeline {

namespace fs = std::filesystem;

namespace {

constexpr int exit_user_error = 40, exit_memory = 41, exit_exception = 42, exit_system = 43;

/// A scratch folder that goes with its scope.
class Scratch {
 public:
  Scratch() {
    std::string pattern = (fs::temp_directory_path() / "geocage-worker-XXXXXX").string();
    if (!mkdtemp(pattern.data())) throw std::system_error(errno, std::generic_category(), pattern);
    path_ = pattern;
    fs::create_directory(path_ / "value");
  }
  ~Scratch() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  fs::path value() const { return path_ / "value"; }
  fs::path message() const { return path_ / "message"; }

 private:
  fs::path path_;
};

std::uint64_t virtual_memory_bytes() {
  std::ifstream statm("/proc/self/statm");
  std::uint64_t pages = 0;
  statm >> pages;
  return pages * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

void limit_this_process(const WorkerLimits& limits) {
  const rlimit no_core{0, 0};
  setrlimit(RLIMIT_CORE, &no_core);
  const auto seconds =
      static_cast<rlim_t>(std::ceil(limits.seconds) + 1) * static_cast<rlim_t>(limits.threads);
  const rlimit cpu{seconds, seconds};
  setrlimit(RLIMIT_CPU, &cpu);
#ifndef __SANITIZE_ADDRESS__  // its shadow memory alone is terabytes of address space
  const auto bytes = virtual_memory_bytes() + static_cast<std::uint64_t>(limits.memory_gib * (1ull << 30));
  const rlimit memory{bytes, bytes};
  setrlimit(RLIMIT_AS, &memory);
#endif
}

void keep_message(const fs::path& file, const UserError& error) {
  std::ofstream out(file, std::ios::binary);
  out << static_cast<int>(error.fault()) << '\0' << error.where() << '\0' << error.sentence() << '\0'
      << error.hint();
}

[[noreturn]] void throw_message(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::string fault, where, sentence, hint;
  std::getline(in, fault, '\0');
  std::getline(in, where, '\0');
  std::getline(in, sentence, '\0');
  std::getline(in, hint, '\0');
  throw UserError(static_cast<Fault>(std::stoi(fault)), where, sentence, hint);
}

/// Trouble with a disk stays trouble with a disk; the message may be lost when that disk is full.
[[noreturn]] void throw_system_error(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::string code, text;
  std::getline(in, code, '\0');
  std::getline(in, text, '\0');
  throw std::system_error(code.empty() ? EIO : std::stoi(code), std::generic_category(), text);
}

[[noreturn]] void be_the_worker(const WorkerLimits& limits, pid_t parent, const Scratch& scratch,
                                const std::function<void(const fs::path&)>& work) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(exit_exception);
  for (int signal_id : {SIGINT, SIGTERM, SIGSEGV, SIGABRT, SIGFPE, SIGBUS}) signal(signal_id, SIG_DFL);
  const int null = open("/dev/null", O_RDWR);
  for (int stream : {0, 1, 2}) dup2(null, stream);
  limit_this_process(limits);
  try {
    work(scratch.value());
    _exit(0);
  } catch (const UserError& error) {
    keep_message(scratch.message(), error);
    _exit(exit_user_error);
  } catch (const std::bad_alloc&) {
    _exit(exit_memory);
  } catch (const std::system_error& error) {
    std::ofstream(scratch.message()) << error.code().value() << '\0' << error.what();
    _exit(exit_system);
  } catch (const std::exception& error) {
    std::ofstream(scratch.message()) << error.what();
    _exit(exit_exception);
  } catch (...) {
    _exit(exit_exception);
  }
}

/// Waits at most `seconds`; false when the child had to be killed.
bool wait_for(pid_t child, double seconds, int& status) {
  const int handle = static_cast<int>(syscall(SYS_pidfd_open, child, 0));
  bool in_time = true;
  if (handle >= 0) {
    pollfd ready{handle, POLLIN, 0};
    int answer;
    do {
      answer = poll(&ready, 1, static_cast<int>(seconds * 1000));
    } while (answer < 0 && errno == EINTR);
    in_time = answer != 0;
    close(handle);
  }
  if (!in_time) kill(child, SIGKILL);
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return in_time;
}

}  // namespace

std::string_view word(Loss loss) {
  constexpr std::string_view words[] = {"crash", "timeout", "out_of_memory", "exception"};
  return words[static_cast<int>(loss)];
}

void run_contained(const WorkerLimits& limits, const std::string& where,
                   const std::function<void(const fs::path&)>& work,
                   const std::function<void(const fs::path&)>& collect) {
  const Scratch scratch;
  const pid_t parent = getpid();
  const pid_t child = fork();
  if (child < 0) throw std::system_error(errno, std::generic_category(), "fork of a worker for " + where);
  if (child == 0) be_the_worker(limits, parent, scratch, work);

  int status = 0;
  const bool in_time = wait_for(child, limits.seconds, status);
  const auto fail = [&](Loss loss, const std::string& sentence) {
    throw WorkerLost(loss, where, limits.subject + " " + sentence, limits.hint);
  };
  const bool signalled = WIFSIGNALED(status);
  if (!in_time || (signalled && WTERMSIG(status) == SIGXCPU))
    fail(Loss::timeout, "did not end within " + std::to_string(static_cast<int>(limits.seconds)) + " s");
  if (signalled) fail(Loss::crash, std::string("crashed (") + strsignal(WTERMSIG(status)) + ")");
  switch (WEXITSTATUS(status)) {
    case 0:
      collect(scratch.value());
      return;
    case exit_user_error:
      throw_message(scratch.message());
    case exit_memory:
      fail(Loss::memory,
           "asked for more than " + std::to_string(static_cast<int>(limits.memory_gib)) + " GiB");
      return;
    case exit_system:
      throw_system_error(scratch.message());
    default: {
      std::ifstream message(scratch.message());
      std::string text;
      std::getline(message, text);
      fail(Loss::exception, "failed" + (text.empty() ? "" : ": " + text));
    }
  }
}

}  // namespace geocage::pipeline
