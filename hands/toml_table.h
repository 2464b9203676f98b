#pragma once
#include <filesystem>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include <toml++/toml.h>

#include "hands/kinematics.h"
#include "pipeline/error.h"

namespace geocage::hands {

/// The table that the text of `file` holds. A mistake is a UserError (configuration) with file, line and
/// column.
toml::table toml_of(std::string_view text, const std::filesystem::path& file);
/// The same of the file itself.
toml::table toml_of(const std::filesystem::path& file);

/// A table of a TOML file. Every key is asked for once, with its type; `end` refuses the keys that nobody
/// asked for. Mistakes are UserErrors (configuration) with file, line and column. Precondition: the table was
/// parsed with the path of its file, and outlives this.
class TomlTable {
 public:
  /// `page`: where the keys are explained.
  explicit TomlTable(const toml::table& table, std::string page = "hands/README.md")
      : table_(table), page_(std::move(page)) {}

  bool has(const std::string& key) const { return table_.contains(key); }

  template <class T>
  T get(const std::string& key) {
    const auto value = node(key).value<T>();
    if (!value) wrong(key, std::is_same_v<T, double> ? "is not a number" : "is not a text");
    if constexpr (std::is_same_v<T, double>) check_finite(key, *value);
    return *value;
  }

  template <class T>
  std::vector<T> list(const std::string& key) {
    std::vector<T> values;
    const toml::array* array = node(key).as_array();
    if (!array) wrong(key, "is not a list");
    for (const auto& element : *array) {
      const auto value = element.value<T>();
      if (!value)
        wrong(key, std::is_same_v<T, double> ? "is not a list of numbers" : "is not a list of texts");
      if constexpr (std::is_same_v<T, double>) check_finite(key, *value);
      values.push_back(*value);
    }
    return values;
  }

  Vec3 vector(const std::string& key);
  Vec3 direction(const std::string& key);
  /// In (0, 10) m.
  double length(const std::string& key);
  /// In (0, most].
  double positive(const std::string& key, double most);
  std::vector<TomlTable> tables(const std::string& key);
  TomlTable table(const std::string& key);
  std::vector<std::string> keys() const;

  /// An index that `find` looks up by `name`, which stands in `key`; an unknown name is refused with its
  /// line.
  template <class Find>
  int index(const std::string& key, const std::string& name, const Find& find) {
    try {
      return find(name);
    } catch (const pipeline::UserError& error) {
      throw pipeline::UserError(pipeline::Fault::configuration, where(key), error.sentence(), error.hint());
    }
  }

  void end() const;
  [[noreturn]] void wrong(const std::string& key, const std::string& sentence) const;
  /// file:line:column of a key that is there.
  std::string where(const std::string& key) const;
  /// The file that a key came from.
  std::string file_of(const std::string& key) const;

 private:
  const toml::node& node(const std::string& key);
  void check_finite(const std::string& key, double x) const;

  const toml::table& table_;
  std::string page_;
  std::vector<std::string> known_;
};

}  // namespace geocage::hands
