#include "cli/console.h"

#include <algorithm>
#include <cstdio>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "pipeline/spelling.h"

namespace geocage::cli {

namespace {
constexpr const char* clear_line = "\r\x1b[K";

void write_raw(const std::string& text) {
  std::fwrite(text.data(), 1, text.size(), stderr);
}
}  // namespace

Console::Console(bool quiet) : quiet_(quiet), terminal_(isatty(STDERR_FILENO) != 0) {}
Console::~Console() {
  if (!quiet_ && terminal_) write_raw(clear_line);
}

void Console::line(const std::string& text) {
  if (quiet_) return;
  if (terminal_) write_raw(clear_line);
  tell(text + "\n");
  bar();
}

void Console::planned(std::size_t pairs, std::size_t slots, int jobs) {
  line(fmt::format("{} pairs of object and hand, {} slots, {} at a time", pairs, slots, jobs));
}

/// Slots a minute, and how long the rest takes at that pace; what is there already says nothing about it.
std::string Console::pace() const {
  const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - begun_;
  if (made_ < 3 || passed.count() < 2) return "";
  const double per_second = static_cast<double>(made_) / passed.count();
  const auto left_s = static_cast<long>(static_cast<double>(total_ - ended_) / per_second);
  return fmt::format(" {:.1f}/min, {}:{:02} left", 60 * per_second, left_s / 60, left_s % 60);
}

void Console::bar() {
  if (quiet_ || !terminal_ || total_ == 0) return;
  const std::size_t width = 24, full = width * ended_ / total_;
  std::string names;
  for (const auto& [slot, how_far] : running_) names.append(" ").append(slot).append(how_far);
  std::ranges::replace(names, '\n', ' ');
  write_raw(clear_line);
  tell(fmt::format("[{:=<{}}{: <{}}] {}/{}{}{:.80}", "", full, "", width - full, ended_, total_, pace(),
                   names));
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
  if (result.state == SlotState::made) {
    ++made_;
    line(fmt::format("{} {} {} {:.2f} s{}", count, result.slot, state, result.seconds,
                     terminal_ ? "" : pace()));
  }
  if (result.state == SlotState::failed || result.state == SlotState::skipped)
    line(fmt::format("{} {} {}: {}", count, result.slot, state, result.sentence));
  if (result.state == SlotState::hit) bar();
}

void print_json(const nlohmann::json& document, int indent) {
  fmt::print("{}\n", document.dump(indent, ' ', false, nlohmann::json::error_handler_t::replace));
}

void tell(const std::string& text) {
  write_raw(pipeline::plain_text(text));
}

}  // namespace geocage::cli
