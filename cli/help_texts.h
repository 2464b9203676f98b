#pragma once
#include <string>

namespace CLI {  // NOLINT(readability-identifier-naming): the library's name
class App;
}

namespace geocage::cli {

/// What follows the options in a command's help: an example, and the exit codes.
std::string footer(const std::string& command);

/// The program's manual in roff (`man -l`), and the completion script of bash. Both are made from the
/// declared commands, so they can't fall behind.
std::string man_page(const CLI::App& app);
std::string bash_completion(const CLI::App& app);

}  // namespace geocage::cli
