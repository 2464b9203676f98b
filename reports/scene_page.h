#pragma once
#include <filesystem>
#include <string>

#include "reports/report.h"

namespace geocage::reports {

/// Two pictures of a scene, seen from its sensor: its points with a colour an object and all else grey, and
/// the closed surfaces in the same colours. Files begin with `prefix`. Errors: UserError (store) for a broken
/// artefact.
std::string scene_section(const SceneInput& scene, const std::filesystem::path& pictures,
                          const std::string& prefix);

}  // namespace geocage::reports
