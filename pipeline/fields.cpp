#include "pipeline/fields.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstdlib>

namespace geocage::pipeline {

Fields& Fields::operator()(const char* name, bool& value, const char* help) {
  list_.push_back({name, &value, {}, {}, help});
  return *this;
}
Fields& Fields::operator()(const char* name, int& value, Range range, const char* help) {
  list_.push_back({name, &value, range, {}, help});
  return *this;
}
Fields& Fields::operator()(const char* name, std::uint64_t& value, const char* help) {
  list_.push_back({name, &value, {0}, {}, help});
  return *this;
}
Fields& Fields::operator()(const char* name, double& value, Range range, const char* help) {
  list_.push_back({name, &value, range, {}, help});
  return *this;
}
Fields& Fields::operator()(const char* name, std::string& value, std::vector<std::string> choices,
                           const char* help) {
  list_.push_back({name, &value, {}, std::move(choices), help});
  return *this;
}
Fields& Fields::operator()(const char* name, std::vector<double>& value, Range range, const char* help) {
  list_.push_back({name, &value, range, {}, help});
  return *this;
}
Fields& Fields::operator()(const char* name, std::vector<std::string>& value,
                           std::vector<std::string> choices, const char* help) {
  list_.push_back({name, &value, {}, std::move(choices), help});
  return *this;
}

Fields& Fields::only_with(const char* with, std::vector<std::string> values) {
  list_.back().with = with;
  list_.back().with_values = std::move(values);
  return *this;
}

namespace {

template <class Number>
std::string digits(Number x) {
  char text[40];
  const auto end = std::to_chars(text, text + sizeof text, x).ptr;
  return {text, end};
}

std::string text(bool x) {
  return x ? "true" : "false";
}
std::string text(int x) {
  return digits(x);
}
std::string text(std::uint64_t x) {
  return digits(x);
}
std::string text(double x) {
  if (std::isnan(x)) {
    std::fprintf(stderr, "geocage: broken invariant: a parameter is NaN\n");
    std::abort();
  }
  return digits(x == 0 ? 0.0 : x);
}
std::string text(const std::string& x) {
  std::string quoted = "\"";
  for (char c : x) {
    if (c == '"' || c == '\\') quoted += '\\';
    if (c == '\n') {
      quoted += "\\n";
      continue;
    }
    quoted += c;
  }
  return quoted + '"';
}
template <class Element>
std::string text(const std::vector<Element>& list) {
  std::string joined = "[";
  for (const auto& x : list) joined += (joined.size() > 1 ? ", " : "") + text(x);
  return joined + "]";
}

/// `"a" or "b"`
std::string any_of_text(const std::vector<std::string>& values) {
  std::string words;
  for (const auto& value : values) words += (words.empty() ? "" : " or ") + text(value);
  return words;
}

std::string type_name(const Field::Value& value) {
  constexpr const char* names[] = {"true or false", "whole number",    "whole number", "number",
                                   "text",          "list of numbers", "list of texts"};
  return names[value.index()];
}

}  // namespace

std::string value_text(const Field& field) {
  return std::visit([](const auto* x) { return text(*x); }, field.value);
}

std::string type_text(const Field& field) {
  std::string words = type_name(field.value);
  if (!field.choices.empty()) {
    words += std::holds_alternative<std::string*>(field.value) ? ", one of:" : ", each one of:";
    for (const auto& choice : field.choices) words += (words.back() == ':' ? " " : ", ") + choice;
  }
  const bool low = std::isfinite(field.range.low), high = std::isfinite(field.range.high);
  if (low && high) words += " in [" + text(field.range.low) + ", " + text(field.range.high) + "]";
  if (low && !high) words += " >= " + text(field.range.low);
  if (!low && high) words += " <= " + text(field.range.high);
  if (!field.with.empty()) words += "; with " + field.with + " " + any_of_text(field.with_values);
  return words;
}

std::string why_idle(const Field& field, const Fields& fields) {
  for (const Field& with : fields.list()) {
    if (field.with.empty() || with.name != field.with) continue;
    std::vector<std::string> now;
    if (const auto* one = std::get_if<std::string*>(&with.value)) now = {**one};
    if (const auto* list = std::get_if<std::vector<std::string>*>(&with.value)) now = **list;
    for (const auto& value : field.with_values)
      if (std::find(now.begin(), now.end(), value) != now.end()) return "";
    return with.name + " is " + value_text(with) + ", and " + field.name + " counts with " +
           any_of_text(field.with_values);
  }
  return "";
}

}  // namespace geocage::pipeline
