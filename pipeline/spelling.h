#pragma once
#include <string>

namespace geocage::pipeline {

// How a name is spelt where something else reads it.

/// UTF-8 without control characters: every other byte becomes %XX.
std::string plain_name(const std::string& name);
/// What a terminal would obey is shown in hexadecimal, but for ends of lines and tabs.
std::string plain_text(const std::string& text);
/// One word for a POSIX shell.
std::string for_shell(const std::string& word);
/// One cell of comma-separated values (RFC 4180).
std::string for_csv(const std::string& cell);
/// One identifier of Graphviz's DOT.
std::string for_dot(const std::string& name);

}  // namespace geocage::pipeline
