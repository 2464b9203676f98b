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
};

/// The one list of a stage's parameters. A parameter struct names each field once in `visit(Fields&)`;
/// TOML, hashing, help and docs read that list.
class Fields {
 public:
  void operator()(const char* name, bool& value, const char* help);
  void operator()(const char* name, int& value, Range range, const char* help);
  void operator()(const char* name, std::uint64_t& value, const char* help);
  void operator()(const char* name, double& value, Range range, const char* help);
  void operator()(const char* name, std::string& value, std::vector<std::string> choices, const char* help);
  void operator()(const char* name, std::vector<double>& value, Range range, const char* help);
  void operator()(const char* name, std::vector<std::string>& value, std::vector<std::string> choices,
                  const char* help);

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

/// What type and bounds a field has, in words: "number in [0, 1]", "one of: hop, dijkstra".
std::string type_text(const Field& field);

}  // namespace geocage::pipeline
