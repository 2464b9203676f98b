#pragma once
#include <span>
#include <string>

namespace CLI {  // NOLINT(readability-identifier-naming): the library's name
class App;
}

namespace geocage::cli {

/// What follows the options in a command's help: an example, and the exit codes.
std::string footer(const std::string& command);

/// "there is no command 'scor'; did you mean 'score'?": the first word that no command or flag has; empty
/// where all are known.
std::string unknown_word(const CLI::App& app, std::span<const std::string> words);

/// The program's manual in roff (`man -l`), and the completion script of bash. Both are made from the
/// declared commands, so they can't fall behind.
std::string man_page(const CLI::App& app);
std::string bash_completion(const CLI::App& app);

}  // namespace geocage::cli
