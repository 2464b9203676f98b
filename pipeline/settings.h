#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <variant>
#include <vector>

#include "pipeline/error.h"
#include "pipeline/fields.h"

namespace geocage::pipeline {

/// A value somebody wrote, before it is known what it is for.
using SettingValue =
    std::variant<bool, std::int64_t, double, std::string, std::vector<double>, std::vector<std::string>>;

/// `stage.field = value`, with where it was said ("flow.toml:3:1" or "--set").
struct Setting {
  std::string where, stage, field;
  SettingValue value;
};

/// All mistakes of a configuration at once, one line each.
class ConfigurationError : public UserError {
 public:
  explicit ConfigurationError(std::vector<std::string> mistakes);
  const char* what() const noexcept override { return text_.c_str(); }
  const std::vector<std::string>& mistakes() const { return mistakes_; }

 private:
  std::vector<std::string> mistakes_;
  std::string text_;
};

/// "where: error: [stage] sentence"
std::string mistake(const std::string& where, const std::string& stage, const std::string& sentence);
/// "; did you mean 'x'?", empty when no known name is near
std::string did_you_mean(const std::string& word, const std::vector<std::string>& known);

/// Puts the value into its field, or adds a line to `mistakes`: unknown name (with the nearest one), wrong
/// type, out of range, not among the choices.
void apply(const Setting& setting, const Fields& fields, std::vector<std::string>& mistakes);

/// A configuration file as settings. `[stage]` tables give one Setting a key; `[a.b.c]` tables have the stage
/// "a.b.c". Top-level keys have an empty stage; quoted keys of `[sweep]` keep their dots. Every mistake of
/// syntax is a ConfigurationError with `file:line:column`; a missing file is a UserError.
std::vector<Setting> read_settings(const std::filesystem::path& file);

/// `stage.field=value` of the command line, its value in TOML notation (a bare word is a text).
Setting parse_setting(const std::string& text);

}  // namespace geocage::pipeline
