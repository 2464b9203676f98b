#include "hands/toml_table.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

#include <fmt/format.h>

#include "pipeline/nearest.h"

namespace geocage::hands {

toml::table toml_of(std::string_view text, const std::filesystem::path& file) {
  try {
    return toml::parse(text, file.string());
  } catch (const toml::parse_error& error) {
    const auto& at = error.source().begin;
    throw pipeline::UserError(pipeline::Fault::configuration,
                              fmt::format("{}:{}:{}", file.string(), at.line, at.column),
                              std::string(error.description()));
  }
}

toml::table toml_of(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::ostringstream text;
  text << in.rdbuf();
  if (!in)
    throw pipeline::UserError(pipeline::Fault::configuration, file.string(), "this file can't be read");
  return toml_of(text.str(), file);
}

using pipeline::Fault;
using pipeline::UserError;

namespace {

std::string place_of(const toml::node& node) {
  const auto& source = node.source();
  return fmt::format("{}:{}:{}", source.path ? *source.path : "", source.begin.line, source.begin.column);
}

}  // namespace

Vec3 TomlTable::vector(const std::string& key) {
  const auto x = list<double>(key);
  if (x.size() != 3) wrong(key, "is not a list of three numbers");
  return {x[0], x[1], x[2]};
}

Vec3 TomlTable::direction(const std::string& key) {
  const Vec3 v = vector(key);
  if (v.norm() < 1e-9) wrong(key, "has no direction");
  return v.normalized();
}

double TomlTable::length(const std::string& key) {
  const double x = get<double>(key);
  if (!(x > 0 && x < 10)) wrong(key, "is outside (0, 10) m");
  return x;
}

double TomlTable::positive(const std::string& key, double most) {
  const double x = get<double>(key);
  if (!(x > 0 && x <= most)) wrong(key, fmt::format("is outside (0, {}]", most));
  return x;
}

std::vector<TomlTable> TomlTable::tables(const std::string& key) {
  std::vector<TomlTable> rows;
  const toml::array* array = node(key).as_array();
  if (!array || array->empty() || !array->is_homogeneous<toml::table>())
    wrong(key, "is not a list of tables: [[" + key + "]]");
  for (const auto& element : *array) rows.emplace_back(*element.as_table(), page_);
  return rows;
}

TomlTable TomlTable::table(const std::string& key) {
  const toml::table* found = node(key).as_table();
  if (!found) wrong(key, "is not a table: [" + key + "]");
  return TomlTable(*found, page_);
}

std::vector<std::string> TomlTable::keys() const {
  std::vector<std::string> names;
  for (const auto& [key, value] : table_) names.emplace_back(key.str());
  return names;
}

void TomlTable::end() const {
  for (const auto& [key, value] : table_)
    if (std::find(known_.begin(), known_.end(), key.str()) == known_.end())
      throw UserError(Fault::configuration, place_of(value), "unknown key '" + std::string(key.str()) + "'",
                      "the nearest key is '" + pipeline::nearest_name(std::string(key.str()), known_) + "'");
}

void TomlTable::wrong(const std::string& key, const std::string& sentence) const {
  throw UserError(Fault::configuration, where(key), key + " " + sentence, "see " + page_);
}

std::string TomlTable::where(const std::string& key) const {
  return place_of(*table_.get(key));
}

std::string TomlTable::file_of(const std::string& key) const {
  return *table_.get(key)->source().path;
}

const toml::node& TomlTable::node(const std::string& key) {
  known_.push_back(key);
  const toml::node* found = table_.get(key);
  if (!found)
    throw UserError(Fault::configuration, place_of(table_), "the key '" + key + "' is missing",
                    "see " + page_);
  return *found;
}

void TomlTable::check_finite(const std::string& key, double x) const {
  if (!std::isfinite(x)) wrong(key, "is not finite");
}

}  // namespace geocage::hands
