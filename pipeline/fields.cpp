#include "pipeline/fields.h"

#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstdlib>

namespace geocage::pipeline {

void Fields::operator()(const char* name, bool& value, const char* help) {
  list_.push_back({name, &value, {}, {}, help});
}
void Fields::operator()(const char* name, int& value, Range range, const char* help) {
  list_.push_back({name, &value, range, {}, help});
}
void Fields::operator()(const char* name, std::uint64_t& value, const char* help) {
  list_.push_back({name, &value, {0}, {}, help});
}
void Fields::operator()(const char* name, double& value, Range range, const char* help) {
  list_.push_back({name, &value, range, {}, help});
}
void Fields::operator()(const char* name, std::string& value, std::vector<std::string> choices,
                        const char* help) {
  list_.push_back({name, &value, {}, std::move(choices), help});
}
void Fields::operator()(const char* name, std::vector<double>& value, Range range, const char* help) {
  list_.push_back({name, &value, range, {}, help});
}
void Fields::operator()(const char* name, std::vector<std::string>& value, std::vector<std::string> choices,
                        const char* help) {
  list_.push_back({name, &value, {}, std::move(choices), help});
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
  return words;
}

}  // namespace geocage::pipeline
