#include "stages/evaluate/presets.h"

#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "pipeline/error.h"

namespace geocage::stages {
namespace {

const std::vector<Protocol>& presets() {
  static const std::vector<Protocol> table = {{.name = "geocage-force", .engine = {}, .grip = {}}};
  return table;
}

}  // namespace

std::vector<std::string> protocol_names() {
  std::vector<std::string> names;
  for (const Protocol& preset : presets()) names.push_back(preset.name);
  return names;
}

const Protocol& find_protocol(std::string_view name) {
  const auto found = std::ranges::find(presets(), name, &Protocol::name);
  if (found != presets().end()) return *found;
  throw pipeline::UserError(pipeline::Fault::configuration, "evaluate.protocol",
                            fmt::format("there is no protocol '{}'", name),
                            fmt::format("known: {}", fmt::join(protocol_names(), ", ")));
}

}  // namespace geocage::stages
