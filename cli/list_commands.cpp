#include <functional>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "cli/console.h"
#include "datasets/catalogue.h"

namespace geocage::cli {

using nlohmann::json;

int list_stages(const Shared& shared) {
  StageParameters parameters;
  json list = json::array();
  for_each_stage(parameters, [&](const char* name, int version, const char* what, auto&) {
    if (shared.json)
      list.push_back({{"stage", name}, {"version", version}, {"what", what}});
    else
      fmt::print("{:<12} {:>2}  {}\n", name, version, what);
  });
  if (shared.json) print_json(json{{"schema", "geocage-stages 1"}, {"stages", list}});
  return 0;
}

int list_params(const Shared& shared, const std::string& stage) {
  StageParameters parameters;
  json list = json::array();
  const pipeline::Fields fields = fields_of_stage(parameters, stage);
  for (const auto& field : fields.list()) {
    const std::string value = pipeline::value_text(field), type = pipeline::type_text(field);
    if (shared.json)
      list.push_back({{"name", field.name}, {"default", value}, {"type", type}, {"help", field.help}});
    else
      fmt::print("{:<24} {:<24} {}\n{:<24} {}\n", field.name, value, type, "", field.help);
  }
  if (shared.json) print_json(json{{"schema", "geocage-params 1"}, {"stage", stage}, {"fields", list}});
  return 0;
}

namespace {

using datasets::Availability;
using datasets::Entry;
using datasets::Presence;

std::string_view word(Presence presence) {
  constexpr std::string_view words[] = {"have", "fetched", "unavailable", "mismatch"};
  return words[static_cast<int>(presence)];
}

bool there(const Availability& found) {
  return found.presence == Presence::have || found.presence == Presence::fetched;
}

std::string source_of(const Entry& entry) {
  if (!entry.shape.empty()) return "made: " + entry.shape;
  if (!entry.npm.empty()) return "npm: " + entry.npm;
  return entry.url.empty() ? entry.package : entry.url;
}

/// Prints what `look` finds of each entry; 0 when all are there.
int list_entries(const Shared& shared, const std::vector<Entry>& entries,
                 const std::function<Availability(const Entry&)>& look) {
  json list = json::array();
  bool all = true;
  for (const auto& entry : entries) {
    const Availability found = look(entry);
    all = all && there(found);
    list.push_back({{"object", entry.name},
                    {"kind", entry.kind},
                    {"package", entry.package},
                    {"source", source_of(entry)},
                    {"set", entry.set},
                    {"licence", entry.licence},
                    {"unit", entry.unit},
                    {"sha256", entry.sha256},
                    {"state", word(found.presence)},
                    {"file", found.file.string()},
                    {"reason", found.reason}});
    if (!shared.json)
      fmt::print("{:<16} {:<11} {:<6} {} ({}) {}\n", entry.name, word(found.presence), entry.kind,
                 source_of(entry), entry.shape.empty() ? entry.licence : "shape", found.reason);
  }
  if (shared.json) print_json(json{{"schema", "geocage-datasets 1"}, {"objects", list}});
  return all ? 0 : 1;
}

Availability look(const Entry& entry) {
  return datasets::check(entry, datasets::datasets_folder());
}

}  // namespace

int list_datasets(const Shared& shared) {
  list_entries(shared, datasets::load_catalogue(), look);
  return 0;
}

int check_datasets(const Shared& shared) {
  return list_entries(shared, datasets::load_catalogue(), look);
}

int get_dataset(const Shared& shared, const std::string& name) {
  const auto catalogue = datasets::load_catalogue();
  std::vector<Entry> wanted;
  for (const Entry& entry : catalogue)
    if (name == "all" || (!name.empty() && entry.set == name)) wanted.push_back(entry);
  if (wanted.empty()) wanted.push_back(datasets::find_entry(catalogue, name));
  return list_entries(shared, wanted,
                      [](const Entry& entry) { return datasets::get(entry, datasets::datasets_folder()); });
}

}  // namespace geocage::cli
