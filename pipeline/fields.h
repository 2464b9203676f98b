#pragma once
#include <cstdint>
#include <limits>
#include <string>
#include <variant>
#include <vector>

namespace geocage::pipeline {

/// Inclusive bounds of a number.
struct Range {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
};

/// One parameter of a stage: where its value lives and all that files, help and recipes say of it.
struct Field {
  using Value = std::variant<bool*, int*, std::uint64_t*, double*, std::string*, std::vector<double>*,
                             std::vector<std::string>*>;
  std::string name;
  Value value;
  Range range;
  std::vector<std::string> choices;
  std::string help;
  /// It counts only where the field `with` has, or holds, one of these; always where `with` is empty.
  std::string with;
  std::vector<std::string> with_values;
};

/// The one list of a stage's parameters. A parameter struct names each field once in `visit(Fields&)`;
/// TOML, hashing, help and docs read that list.
class Fields {
 public:
  Fields& operator()(const char* name, bool& value, const char* help);
  Fields& operator()(const char* name, int& value, Range range, const char* help);
  Fields& operator()(const char* name, std::uint64_t& value, const char* help);
  Fields& operator()(const char* name, double& value, Range range, const char* help);
  Fields& operator()(const char* name, std::string& value, std::vector<std::string> choices,
                     const char* help);
  Fields& operator()(const char* name, std::vector<double>& value, Range range, const char* help);
  Fields& operator()(const char* name, std::vector<std::string>& value, std::vector<std::string> choices,
                     const char* help);
  /// The field added last counts only where the text or list `with` has one of `values`.
  Fields& only_with(const char* with, std::vector<std::string> values);

  const std::vector<Field>& list() const& { return list_; }
  void list() && = delete;  // the list would die with the temporary

 private:
  std::vector<Field> list_;
};

/// The fields of `params`, which they point into.
template <class Params>
Fields fields_of(Params& params) {
  Fields fields;
  params.visit(fields);
  return fields;
}

/// Value as text: shortest digits that read back as the same number; lists as `[a, b]`, strings quoted.
/// Aborts on NaN; -0.0 is written as 0.
std::string value_text(const Field& field);

/// What type and bounds a field has, in words: "number in [0, 1]", "one of: hop, dijkstra"; and what it
/// counts with.
std::string type_text(const Field& field);

/// Why a field of `fields` does nothing now: `size_by is "edge_length", and vertices counts with "vertices"`;
/// empty where it counts.
std::string why_idle(const Field& field, const Fields& fields);

}  // namespace geocage::pipeline
