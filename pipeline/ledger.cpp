#include "pipeline/ledger.h"

#include <algorithm>
#include <fstream>
#include <system_error>

#include "pipeline/digest.h"
#include "pipeline/text_file.h"

namespace geocage::pipeline {

namespace fs = std::filesystem;

namespace {

constexpr const char* first_line = "geocage-failure 1";

/// Names of variants are long and free; a digest is a file name everywhere.
fs::path file_of(const fs::path& root, const std::string& slot) {
  return root / (sha256_of(slot) + ".failure");
}

std::string one_line(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

/// Members in the order of the file's lines.
constexpr std::string Failure::*members[] = {&Failure::slot,     &Failure::stage,  &Failure::code,
                                             &Failure::sentence, &Failure::key,    &Failure::program,
                                             &Failure::inputs,   &Failure::command};

std::optional<Failure> read(const fs::path& file) {
  std::ifstream in(file);
  std::string line;
  if (!std::getline(in, line) || line != first_line) return {};
  Failure failure;
  for (auto member : members)
    if (!std::getline(in, failure.*member)) return {};
  return failure;
}

}  // namespace

std::optional<Failure> Ledger::find(const std::string& slot) const {
  return read(file_of(root_, slot));
}

std::vector<Failure> Ledger::all() const {
  std::vector<Failure> failures;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(root_, none))
    if (entry.path().extension() == ".failure")
      if (auto failure = read(entry.path())) failures.push_back(std::move(*failure));
  std::ranges::sort(failures, {}, &Failure::slot);
  return failures;
}

void Ledger::write(const Failure& failure) const {
  fs::create_directories(root_);
  std::string text = std::string(first_line) + "\n";
  for (auto member : members) text += one_line(failure.*member) + "\n";
  replace_text(file_of(root_, failure.slot), text);
}

void Ledger::forget(const std::string& slot) const {
  std::error_code gone;
  fs::remove(file_of(root_, slot), gone);
}

}  // namespace geocage::pipeline
