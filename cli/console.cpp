#include "cli/console.h"

#include <cstdio>

#include <fmt/format.h>
#include <unistd.h>

namespace geocage::cli {

namespace {
constexpr const char* clear_line = "\r\x1b[K";
}

Console::Console(bool quiet) : quiet_(quiet), terminal_(isatty(STDERR_FILENO) != 0) {}
Console::~Console() {
  if (!quiet_ && terminal_) fmt::print(stderr, "{}", clear_line);
}

void Console::line(const std::string& text) {
  if (quiet_) return;
  fmt::print(stderr, "{}{}\n", terminal_ ? clear_line : "", text);
  bar();
}

void Console::bar() {
  if (quiet_ || !terminal_ || total_ == 0) return;
  const std::size_t width = 24, full = width * ended_ / total_;
  std::string names;
  for (const auto& [slot, how_far] : running_) names += " " + slot + how_far;
  fmt::print(stderr, "{}[{:=<{}}{: <{}}] {}/{}{:.80}", clear_line, "", full, "", width - full, ended_, total_,
             names);
  std::fflush(stderr);
}

void Console::started(const std::string& slot, std::size_t ended, std::size_t total) {
  ended_ = ended;
  total_ = total;
  running_[slot] = "";
  bar();
}

void Console::progress(const std::string& slot, std::size_t done, std::size_t total) {
  running_[slot] = fmt::format(" {}/{}", done, total);
  bar();
}

void Console::log(const std::string& slot, std::string_view sentence) {
  line(fmt::format("{}: {}", slot, sentence));
}

void Console::ended(const pipeline::SlotResult& result, std::size_t ended, std::size_t total) {
  using pipeline::SlotState;
  ended_ = ended;
  total_ = total;
  running_.erase(result.slot);
  const std::string count = fmt::format("[{:>{}}/{}]", ended, std::to_string(total).size(), total);
  const auto state = pipeline::word(result.state);
  if (result.state == SlotState::made)
    line(fmt::format("{} {} {} {:.2f} s", count, result.slot, state, result.seconds));
  if (result.state == SlotState::failed || result.state == SlotState::skipped)
    line(fmt::format("{} {} {}: {}", count, result.slot, state, result.sentence));
  if (result.state == SlotState::hit) bar();
}

}  // namespace geocage::cli
