#include "pipeline/worker.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <fstream>
#include <new>
#include <system_error>
#include <vector>

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include "pipeline/error.h"
#include "pipeline/passing_folder.h"

namespace geocage::pipeline {

namespace fs = std::filesystem;

namespace {

using Clock = std::chrono::steady_clock;

/// How far a worker is, as it goes through the pipe: less than PIPE_BUF, so always whole.
using Mark = std::array<std::uint64_t, 2>;
int ear_of_parent = -1;  ///< in a worker whose parent listens

/// A pipe that nobody else inherits over an exec.
class Pipe {
 public:
  Pipe() {
    if (pipe2(ends_, O_CLOEXEC | O_NONBLOCK) != 0)
      throw std::system_error(errno, std::generic_category(), "pipe");
  }
  ~Pipe() {
    close(ends_[0]);
    close(ends_[1]);
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;
  int out() const { return ends_[0]; }
  int in() const { return ends_[1]; }

 private:
  int ends_[2];
};

constexpr int exit_user_error = 40, exit_memory = 41, exit_exception = 42, exit_system = 43;

/// What a worker leaves, and the sentence that it fails with.
class Scratch {
 public:
  Scratch() { fs::create_directory(value()); }
  fs::path value() const { return folder_.path() / "value"; }
  fs::path message() const { return folder_.path() / "message"; }

 private:
  PassingFolder folder_;
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
  const rlimit cpu{seconds, seconds + 5};  // SIGXCPU first: SIGKILL means that memory ran out
  setrlimit(RLIMIT_CPU, &cpu);
#ifndef __SANITIZE_ADDRESS__  // its shadow memory alone is terabytes of address space
  // Before it holds anything a thread takes 8 MiB of addresses for its stack and 64 MiB for glibc's arena.
  const auto of_threads = static_cast<std::uint64_t>(limits.threads) * (72ull << 20);
  const auto bytes =
      virtual_memory_bytes() + of_threads + static_cast<std::uint64_t>(limits.memory_gib * (1ull << 30));
  const rlimit memory{bytes, bytes};
  setrlimit(RLIMIT_AS, &memory);
#endif
}

/// A worker may have lost a worker of its own: how is kept.
void keep_message(const fs::path& file, const UserError& error) {
  const auto* lost = dynamic_cast<const WorkerLost*>(&error);
  std::ofstream out(file, std::ios::binary);
  out << static_cast<int>(error.fault()) << '\0' << error.where() << '\0' << error.sentence() << '\0'
      << error.hint() << '\0' << (lost ? std::to_string(static_cast<int>(lost->loss())) : "");
}

[[noreturn]] void throw_message(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::string fault, where, sentence, hint, loss;
  std::getline(in, fault, '\0');
  std::getline(in, where, '\0');
  std::getline(in, sentence, '\0');
  std::getline(in, hint, '\0');
  std::getline(in, loss, '\0');
  if (!loss.empty()) throw WorkerLost(static_cast<Loss>(std::stoi(loss)), where, sentence, hint);
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

/// Out of memory where nothing may be caught, such as in a thread of OpenMP, is out of memory still.
[[noreturn]] void end_worker() {
  try {
    if (const auto error = std::current_exception()) std::rethrow_exception(error);
  } catch (const std::bad_alloc&) {
    _exit(exit_memory);
  } catch (...) {
  }
  abort();
}

[[noreturn]] void be_the_worker(const WorkerLimits& limits, pid_t parent, const Scratch& scratch,
                                const std::function<void(const fs::path&)>& work, int ear) {
  ear_of_parent = ear;
  std::set_terminate(end_worker);
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
    const bool no_memory = error.code() == std::errc::not_enough_memory ||
                           error.code() == std::errc::resource_unavailable_try_again;  // no thread either
    if (no_memory) _exit(exit_memory);
    std::string what = error.what();  // ends with the words of the code, which are added again
    if (const std::string end = ": " + error.code().message(); what.ends_with(end))
      what.resize(what.size() - end.size());
    std::ofstream(scratch.message()) << error.code().value() << '\0' << what;
    _exit(exit_system);
  } catch (const std::exception& error) {
    std::ofstream(scratch.message()) << error.what();
    _exit(exit_exception);
  } catch (...) {
    _exit(exit_exception);
  }
}

std::string text_of(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", x);
  return text;
}

/// How a worker's process ended.
struct End {
  bool in_time = true;
  int status = 0;
  WorkerUse use;
};

/// Waits at most `seconds`, and listens meanwhile; then the child is killed.
End wait_for(pid_t child, double seconds, const Pipe& pipe, const HowFar& hear) {
  End end;
  const auto listen = [&] {
    for (Mark mark; read(pipe.out(), mark.data(), sizeof mark) == sizeof mark;)
      if (hear) hear(mark[0], mark[1]);
  };
  const int handle = static_cast<int>(syscall(SYS_pidfd_open, child, 0));
  if (handle >= 0) {
    const auto until = Clock::now() + std::chrono::duration<double>(seconds);
    pollfd waited[] = {{handle, POLLIN, 0}, {pipe.out(), POLLIN, 0}};
    while ((waited[0].revents & POLLIN) == 0 && end.in_time) {
      const std::chrono::duration<double, std::milli> left = until - Clock::now();
      const int answer = poll(waited, 2, static_cast<int>(std::clamp(std::ceil(left.count()), 0.0, 1e9)));
      end.in_time = answer != 0;
      if (answer > 0) listen();
    }
    close(handle);
  }
  if (!end.in_time) kill(child, SIGKILL);
  rusage used{};
  while (wait4(child, &end.status, 0, &used) < 0 && errno == EINTR) {
  }
  end.use.peak_memory_gib = static_cast<double>(used.ru_maxrss) / (1 << 20);
  return end;
}

}  // namespace

std::string_view word(Loss loss) {
  constexpr std::string_view words[] = {"crash", "timeout", "out_of_memory", "exception"};
  return words[static_cast<int>(loss)];
}

void tell_how_far(std::size_t done, std::size_t total) {
  static Clock::time_point last;
  if (ear_of_parent < 0 || Clock::now() - last < std::chrono::milliseconds(100)) return;
  last = Clock::now();
  const Mark mark{done, total};
  [[maybe_unused]] const auto written = write(ear_of_parent, mark.data(), sizeof mark);
}

WorkerUse run_contained(const WorkerLimits& limits, const std::string& where,
                        const std::function<void(const fs::path&)>& work,
                        const std::function<void(const fs::path&)>& collect, const HowFar& hear) {
  const Scratch scratch;
  const Pipe pipe;
  const pid_t parent = getpid();
  const pid_t child = fork();
  if (child < 0) throw std::system_error(errno, std::generic_category(), "fork of a worker for " + where);
  if (child == 0) be_the_worker(limits, parent, scratch, work, hear ? pipe.in() : -1);

  const End end = wait_for(child, limits.seconds * limits.patience, pipe, hear);
  const int status = end.status;
  // neither a limit nor a broken file is known to be its cause
  const std::string of_exception = "please report it, with the command and its input";
  const auto fail = [&](Loss loss, const std::string& sentence) {
    throw WorkerLost(loss, where, limits.subject + " " + sentence,
                     loss == Loss::exception ? of_exception : limits.hint);
  };
  const bool signalled = WIFSIGNALED(status);
  if (!end.in_time)
    fail(Loss::timeout, "did not end within " + text_of(limits.seconds * limits.patience) + " s");
  if (signalled && WTERMSIG(status) == SIGXCPU)
    fail(Loss::timeout, "did not end within " + text_of(limits.seconds) + " s of processor time");
  if (signalled && WTERMSIG(status) == SIGKILL)
    fail(Loss::memory, "was killed by the system, which does so when it runs out of memory");
  if (signalled) fail(Loss::crash, std::string("crashed (") + strsignal(WTERMSIG(status)) + ")");
  switch (WEXITSTATUS(status)) {
    case 0:
      collect(scratch.value());
      return end.use;
    case exit_user_error:
      throw_message(scratch.message());
    case exit_memory:
      fail(Loss::memory, "asked for more than " + text_of(limits.memory_gib) + " GiB");
      break;
    case exit_system:
      throw_system_error(scratch.message());
    default: {
      std::ifstream message(scratch.message());
      std::string text;
      std::getline(message, text);
      fail(Loss::exception, "failed" + (text.empty() ? "" : ": " + text));
    }
  }
  return end.use;
}

}  // namespace geocage::pipeline
