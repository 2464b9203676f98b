#pragma once
#include <cstdint>
#include <vector>

#include "geometry/mesh.h"

namespace geocage::tests {

/// A way to break a mesh.
struct Mutator {
  const char* name;
  void (*apply)(geometry::TriangleMesh& mesh, std::uint64_t seed);
};

/// All of them. Each takes a closed mesh and breaks it; the same seed breaks it the same way.
const std::vector<Mutator>& mutators();

}  // namespace geocage::tests
