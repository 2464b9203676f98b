#pragma once
#include <chrono>
#include <map>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "pipeline/pipeline.h"

namespace geocage::cli {

/// One document on stdout; in names that are no UTF-8 what can't be said becomes U+FFFD.
void print_json(const nlohmann::json& document, int indent = 2);

/// On stderr; what a terminal would obey is shown in hexadecimal. A stderr that takes nothing is no error:
/// nobody is there to be told.
void tell(const std::string& text);

/// Shows a run on stderr: a line that redraws itself on a terminal, plain lines otherwise, nothing when
/// quiet.
class Console : public pipeline::Watcher {
 public:
  explicit Console(bool quiet);
  ~Console() override;
  /// What is about to begin.
  void planned(std::size_t pairs, std::size_t slots, int jobs);
  void started(const std::string& slot, std::size_t ended, std::size_t total) override;
  void progress(const std::string& slot, std::size_t done, std::size_t total) override;
  void log(const std::string& slot, std::string_view sentence) override;
  void ended(const pipeline::SlotResult& result, std::size_t ended, std::size_t total) override;

 private:
  void line(const std::string& text);
  void bar();
  std::string pace() const;
  bool quiet_, terminal_;
  std::size_t ended_ = 0, total_ = 0, made_ = 0;
  std::chrono::steady_clock::time_point begun_ = std::chrono::steady_clock::now();
  std::map<std::string, std::string> running_;  ///< slot and how far it is
};

}  // namespace geocage::cli
