#pragma once
#include <filesystem>

namespace geocage::geometry {

/// A foreign file on its way into the pipeline. Recipes know it by the sha256 of its bytes and its format,
/// never by its path.
struct SourceFile {
  std::filesystem::path path;
};

}  // namespace geocage::geometry
