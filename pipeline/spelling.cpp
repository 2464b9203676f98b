#include "pipeline/spelling.h"

#include <array>
#include <cstdio>
#include <string_view>

namespace geocage::pipeline {

namespace {

/// Bytes of the character that `text` begins with; 0 when it is none that may be shown (Unicode 15, table
/// 3-7: no overlong forms, no surrogates, nothing above 10FFFF).
std::size_t character_bytes(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char first = byte(0);
  if (first < 0x80) return first >= 0x20 && first != 0x7f ? 1 : 0;
  const std::size_t length = first >= 0xc2 && first <= 0xdf   ? 2
                             : first >= 0xe0 && first <= 0xef ? 3
                             : first >= 0xf0 && first <= 0xf4 ? 4
                                                              : 0;
  if (length == 0 || text.size() < length) return 0;
  const unsigned char least = first == 0xe0 ? 0xa0 : first == 0xf0 ? 0x90 : 0x80;
  const unsigned char most = first == 0xed ? 0x9f : first == 0xf4 ? 0x8f : 0xbf;
  if (byte(1) < least || byte(1) > most) return 0;
  for (std::size_t i = 2; i < length; ++i)
    if (byte(i) < 0x80 || byte(i) > 0xbf) return 0;
  const bool control = first == 0xc2 && byte(1) < 0xa0;  // C1, which terminals obey as well
  return control ? 0 : length;
}

std::string replaced(const std::string& text, char from, const char* to) {
  std::string out;
  for (const char c : text) out += c == from ? std::string(to) : std::string(1, c);
  return out;
}

/// A byte in two hexadecimal digits.
std::string hex(const char* format, char c) {
  std::array<char, 8> text{};
  std::snprintf(text.data(), text.size(), format, static_cast<unsigned>(c) & 0xffu);
  return text.data();
}

}  // namespace

std::string plain_name(const std::string& name) {
  std::string plain;
  for (std::size_t at = 0; at < name.size();) {
    if (const std::size_t bytes = character_bytes(std::string_view(name).substr(at)); bytes > 0) {
      plain.append(name, at, bytes);
      at += bytes;
      continue;
    }
    plain += hex("%%%02X", name[at++]);
  }
  return plain;
}

std::string plain_text(const std::string& text) {
  std::string plain;
  for (const char c : text) {
    const bool obeyed = (c >= 0 && c < ' ' && c != '\n' && c != '\t') || c == 0x7f;
    plain += obeyed ? hex("\\x%02x", c) : std::string(1, c);
  }
  return plain;
}

std::string for_shell(const std::string& word) {
  if (!word.empty() && word.find_first_of(" '\"$*?[]\\|&;()<>`\n\t!#~{}") == std::string::npos) return word;
  return "'" + replaced(word, '\'', "'\\''") + "'";
}

std::string for_csv(const std::string& cell) {
  if (cell.find_first_of(",\"\r\n") == std::string::npos) return cell;
  return "\"" + replaced(cell, '"', "\"\"") + "\"";
}

std::string for_dot(const std::string& name) {
  // Graphviz makes a line's end of \n even between quotes, so a backslash is doubled, too.
  return "\"" + replaced(replaced(name, '\\', "\\\\"), '"', "\\\"") + "\"";
}

}  // namespace geocage::pipeline
