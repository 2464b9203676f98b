#pragma once
#include "geometry/mesh.h"

namespace geocage::stages {

/// Near-equilateral triangles with `vertices` vertices on the surface of `mesh`.
geometry::TriangleMesh isotropic(const geometry::TriangleMesh& mesh, int vertices, int sweeps);

}  // namespace geocage::stages
