#include "pipeline/settings.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <optional>
#include <sstream>

#include <fmt/format.h>
#include <toml++/toml.h>

#include "pipeline/nearest.h"
#include "pipeline/spelling.h"

namespace geocage::pipeline {

namespace {

std::string join(const std::vector<std::string>& lines) {
  std::string text;
  for (const auto& line : lines) text += (text.empty() ? "" : "\n") + line;
  return text;
}

std::string position(const std::string& file, const toml::source_region& source) {
  return file + ":" + std::to_string(source.begin.line) + ":" + std::to_string(source.begin.column);
}

template <class Element>
std::optional<std::vector<Element>> list_of(const toml::array& array) {
  std::vector<Element> list;
  for (const auto& node : array) {
    const auto x = node.value<Element>();
    if (!x || (std::is_same_v<Element, double> && !node.is_number())) return {};
    list.push_back(*x);
  }
  return list;
}

/// Nothing for dates, tables and mixed lists.
std::optional<SettingValue> value_of(const toml::node& node) {
  if (const auto* x = node.as_boolean()) return x->get();
  if (const auto* x = node.as_integer()) return x->get();
  if (const auto* x = node.as_floating_point()) return x->get();
  if (const auto* x = node.as_string()) return x->get();
  if (const auto* array = node.as_array()) {
    if (auto numbers = list_of<double>(*array); numbers && !array->empty()) return *numbers;
    if (auto texts = list_of<std::string>(*array)) return *texts;
  }
  return {};
}

void collect(const std::string& file, const std::string& stage, const toml::table& table,
             std::vector<Setting>& settings, std::vector<std::string>& mistakes) {
  for (const auto& [key, node] : table) {
    const std::string name(key.str());
    if (const auto* inner = node.as_table()) {
      collect(file, stage.empty() ? name : fmt::format("{}.{}", stage, name), *inner, settings, mistakes);
    } else if (auto value = value_of(node)) {
      settings.push_back({position(file, key.source()), stage, name, std::move(*value)});
    } else {
      mistakes.push_back(
          mistake(position(file, node.source()), stage,
                  name + ": a value must be a truth value, a number, a text, or a list of numbers or texts"));
    }
  }
}

std::optional<double> number(const SettingValue& value) {
  if (const auto* x = std::get_if<std::int64_t>(&value)) return static_cast<double>(*x);
  if (const auto* x = std::get_if<double>(&value)) return *x;
  return {};
}
std::optional<std::int64_t> whole(const SettingValue& value) {
  if (const auto* x = std::get_if<std::int64_t>(&value)) return *x;
  return {};
}

std::string shown(double x) {
  return std::isnan(x) ? "nan" : value_text({"", &x, {}, {}, ""});
}

/// Puts a value into a field of one type; answers what is wrong with it, or nothing.
class Putter {
 public:
  Putter(const SettingValue& value, const Field& field) : value_(value), field_(field) {}

  std::string operator()(bool* at) const { return put(at, std::get_if<bool>(&value_)); }
  /// A number is a text too: `import.cluster = 2`.
  std::string operator()(std::string* at) const {
    std::string text;
    if (const auto x = number(value_))
      text = shown(*x);
    else if (const auto* said = std::get_if<std::string>(&value_))
      text = *said;
    else
      return wrong_type();
    if (!known(text)) return not_known(text);
    *at = text;
    return {};
  }
  std::string operator()(double* at) const {
    const auto x = number(value_);
    return x && !inside(*x) ? outside(*x) : put(at, x ? &*x : nullptr);
  }
  std::string operator()(int* at) const { return put_whole(at); }
  std::string operator()(std::uint64_t* at) const { return put_whole(at); }
  std::string operator()(std::vector<double>* at) const {
    std::vector<double> list;
    if (const auto x = number(value_))
      list = {*x};
    else if (const auto* numbers = std::get_if<std::vector<double>>(&value_))
      list = *numbers;
    else if (const auto* none = std::get_if<std::vector<std::string>>(&value_); !none || !none->empty())
      return wrong_type();
    for (double x : list)
      if (!inside(x)) return outside(x);
    *at = list;
    return {};
  }
  std::string operator()(std::vector<std::string>* at) const {
    std::vector<std::string> list;
    if (const auto* text = std::get_if<std::string>(&value_))
      list = {*text};
    else if (const auto* texts = std::get_if<std::vector<std::string>>(&value_))
      list = *texts;
    else
      return wrong_type();
    for (const auto& text : list)
      if (!known(text)) return not_known(text);
    *at = list;
    return {};
  }

 private:
  template <class T>
  std::string put(T* at, const T* value) const {
    if (!value) return wrong_type();
    *at = *value;
    return {};
  }
  template <class Integer>
  std::string put_whole(Integer* at) const {
    const auto x = whole(value_);
    if (!x) return wrong_type();
    if (!inside(static_cast<double>(*x)) || std::int64_t(Integer(*x)) != *x)
      return outside(static_cast<double>(*x));
    *at = static_cast<Integer>(*x);
    return {};
  }
  bool inside(double x) const { return x >= field_.range.low && x <= field_.range.high && std::isfinite(x); }
  bool known(const std::string& text) const {
    return field_.choices.empty() || std::count(field_.choices.begin(), field_.choices.end(), text) > 0;
  }
  std::string outside(double x) const {
    return shown(x) + " is outside [" + shown(field_.range.low) + ", " + shown(field_.range.high) + "]";
  }
  std::string not_known(const std::string& text) const {
    const std::string meant = did_you_mean(text, field_.choices);
    if (!meant.empty()) return "'" + text + "' is not a choice" + meant;
    std::string all;
    for (const auto& choice : field_.choices) all += (all.empty() ? "" : ", ") + choice;
    return "'" + text + "' is not a choice; there are " + all;
  }
  std::string wrong_type() const { return "the value must be a " + type_text(field_); }

  const SettingValue& value_;
  const Field& field_;
};

}  // namespace

ConfigurationError::ConfigurationError(std::vector<std::string> mistakes)
    : UserError(Fault::configuration, "", join(mistakes)),
      mistakes_(std::move(mistakes)),
      text_(join(mistakes_)) {}

std::string mistake(const std::string& where, const std::string& stage, const std::string& sentence) {
  return where + ": error: " + (stage.empty() ? "" : "[" + stage + "] ") + sentence;
}

std::string did_you_mean(const std::string& word, const std::vector<std::string>& known) {
  const std::string name = near_name(word, known);
  return name.empty() ? "" : "; did you mean '" + name + "'?";
}

void apply(const Setting& setting, const Fields& fields, std::vector<std::string>& mistakes) {
  std::vector<std::string> names;
  for (const Field& field : fields.list()) {
    names.push_back(field.name);
    if (field.name != setting.field) continue;
    const std::string wrong = std::visit(Putter(setting.value, field), field.value);
    if (!wrong.empty())
      mistakes.push_back(mistake(setting.where, setting.stage, setting.field + ": " + wrong));
    return;
  }
  mistakes.push_back(mistake(setting.where, setting.stage,
                             "unknown key '" + setting.field + "'" + did_you_mean(setting.field, names)));
}

std::vector<Setting> read_settings(const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error))
    throw UserError(Fault::configuration, file.string(), "there is no such file", "a flow is a TOML file");
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  if (!in) throw UserError(Fault::configuration, file.string(), "the file can't be read");

  std::vector<Setting> settings;
  std::vector<std::string> mistakes;
  try {
    const toml::table table = toml::parse(text.str(), file.string());
    collect(file.string(), "", table, settings, mistakes);
  } catch (const toml::parse_error& syntax) {
    mistakes.push_back(
        mistake(position(file.string(), syntax.source()), "", std::string(syntax.description())));
  }
  if (!mistakes.empty()) throw ConfigurationError(mistakes);
  std::stable_sort(settings.begin(), settings.end(),
                   [](const Setting& a, const Setting& b) { return a.stage < b.stage; });
  return settings;
}

Setting parse_setting(const std::string& text) {
  const auto equals = text.find('=');
  const auto dot = text.rfind('.', equals);
  if (equals == std::string::npos || dot == std::string::npos || dot > equals)
    throw ConfigurationError({mistake("--set " + text, "", "write it as stage.field=value")});
  Setting setting{"--set " + text, text.substr(0, dot), text.substr(dot + 1, equals - dot - 1), {}};
  const std::string value = text.substr(equals + 1);
  try {
    const toml::table table = toml::parse("value = " + value);
    if (auto known = value_of(*table.get("value"))) {
      setting.value = *known;
      return setting;
    }
  } catch (const toml::parse_error&) {  // a bare word
  }
  if (plain_name(value) != value)
    throw ConfigurationError({mistake(setting.where, "", "this is no text in UTF-8")});
  setting.value = value;
  return setting;
}

}  // namespace geocage::pipeline
