#include "cli/help_texts.h"

#include <algorithm>
#include <map>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "pipeline/settings.h"

namespace geocage::cli {

namespace {

constexpr const char* exit_codes =
    "Exit codes: 0 done; 1 some items failed, were rejected or were skipped; 2 a mistake in the command, a "
    "flow file or a hand; 3 input unreadable or invalid; 4 geometry or numerics failed; 5 store or disk; 70 "
    "a "
    "bug of geocage; 130 interrupted.";

const std::map<std::string, const char*> examples = {
    {"run", "geocage run my_flow.toml --set scan.sigma_m=0.002 --jobs 2"},
    {"status", "geocage status my_flow.toml"},
    {"why", "geocage why mug/place/schunk_sdh"},
    {"show", "geocage show mug/score/schunk_sdh"},
    {"graph", "geocage graph | dot -Tsvg > flow.svg"},
    {"report", "geocage report my_flow.toml --out report --single-file"},
    {"metrics", "geocage metrics '*/remesh'"},
    {"failures", "geocage failures"},
    {"query", "geocage query 'select object, hand, outcome from grasps' --csv"},
    {"verify", "geocage verify"},
    {"gc", "geocage gc --dry-run"},
    {"stages", "geocage stages"},
    {"params", "geocage params place"},
    {"hands", "geocage hands --pictures pictures"},
    {"hands check", "geocage hands check my_hand.urdf"},
    {"datasets", "geocage datasets"},
    {"datasets check", "geocage datasets check"},
    {"datasets get", "geocage datasets get mug"},
    {"score", "geocage score mug.ply --radius-m 0.06 --out scores.ply"},
    {"writhe", "geocage writhe a.csv b.csv --json"},
    {"view", "geocage view mug.ply grasp.json --out view"},
    {"plan", "geocage plan scene.toml --json"},
    {"evaluate", "geocage evaluate --mesh mug.ply --hand schunk_sdh --grasp grasp.json --protocol all"},
    {"man", "geocage man | man -l -"},
    {"completion", "source <(geocage completion)"},
};

using Apps = std::vector<const CLI::App*>;

Apps commands_of(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App*) { return true; });
}

std::vector<const CLI::Option*> options_of(const CLI::App& app) {
  return app.get_options([](const CLI::Option*) { return true; });
}

/// roff takes a dash for a hyphen, and a dot or quote at the start of a line for a request.
std::string roff(const std::string& text) {
  std::string out = text.starts_with('.') || text.starts_with('\'') ? "\\&" : "";
  for (const char c : text) out += c == '-' ? "\\-" : c == '\\' ? "\\e" : std::string(1, c);
  return out;
}

std::string manual_of(const std::string& name, const CLI::App& command) {
  std::string text = fmt::format(".SS {}\n{}.\n", roff(name), roff(command.get_description()));
  for (const CLI::Option* option : options_of(command))
    text += fmt::format(".TP\n.B {}\n{}\n", roff(option->get_name(option->get_positional(), true)),
                        roff(option->get_description().empty() ? " " : option->get_description()));
  if (const auto example = examples.find(name); example != examples.end())
    text += fmt::format(".PP\nExample:\n.PP\n.EX\n{}\n.EE\n", roff(example->second));
  for (const CLI::App* sub : commands_of(command)) text += manual_of(name + " " + sub->get_name(), *sub);
  return text;
}

/// Flags, and names of subcommands: what may follow the command.
std::string words_of(const CLI::App& command) {
  std::vector<std::string> words;
  for (const CLI::App* sub : commands_of(command)) words.push_back(sub->get_name());
  for (const CLI::Option* option : options_of(command))
    for (const auto& name : option->get_lnames()) words.push_back("--" + name);
  return fmt::format("{}", fmt::join(words, " "));
}

}  // namespace

std::string footer(const std::string& command) {
  const auto example = examples.find(command);
  return example == examples.end() ? exit_codes
                                   : fmt::format("Example: {}\n\n{}", example->second, exit_codes);
}

std::string unknown_word(const CLI::App& app, std::span<const std::string> words) {
  if (words.empty()) return "";
  const std::string& word = words.front();
  if (!word.starts_with('-')) {
    std::vector<std::string> names;
    for (const CLI::App* sub : commands_of(app)) {
      if (sub->get_name() == word) return unknown_word(*sub, words.subspan(1));
      names.push_back(sub->get_name());
    }
    if (!names.empty())
      return fmt::format("there is no command '{}'{}", word, pipeline::did_you_mean(word, names));
  }
  std::vector<std::string> flags;
  for (const CLI::Option* option : options_of(app))
    for (const auto& name : option->get_lnames()) flags.push_back("--" + name);
  for (const std::string& each : words) {
    const std::string flag = each.substr(0, each.find('='));
    if (flag.starts_with("--") && std::ranges::find(flags, flag) == flags.end())
      return fmt::format("there is no '{}'{}", flag, pipeline::did_you_mean(flag, flags));
  }
  return "";
}

std::string man_page(const CLI::App& app) {
  std::string text = ".TH GEOCAGE 1\n.SH NAME\ngeocage \\- " +
                     roff("from noisy point clouds of objects to tested caging grasps") +
                     "\n.SH SYNOPSIS\n.B geocage\n.I command\n[options]\n.SH COMMANDS\n";
  for (const CLI::App* command : commands_of(app)) text += manual_of(command->get_name(), *command);
  return text + ".SH EXIT STATUS\n" + roff(exit_codes) + "\n";
}

std::string bash_completion(const CLI::App& app) {
  std::string cases;
  for (const CLI::App* command : commands_of(app))
    cases += fmt::format("    {}) words=\"{}\" ;;\n", command->get_name(), words_of(*command));
  return fmt::format(R"(_geocage() {{
  local words word=${{COMP_WORDS[COMP_CWORD]}}
  case $([ "$COMP_CWORD" -gt 1 ] && echo "${{COMP_WORDS[1]}}") in
{}    *) words="{}" ;;
  esac
  COMPREPLY=($(compgen -W "$words" -- "$word"))
}}
complete -o default -F _geocage geocage
)",
                     cases, words_of(app));
}

}  // namespace geocage::cli
