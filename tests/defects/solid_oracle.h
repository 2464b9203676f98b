#pragma once
#include <string>

#include "geometry/mesh.h"

namespace geocage::tests {

/// What CGAL's own predicates find wrong with a solid: polygon mesh not valid, not closed, cuts itself, not
/// outward, several components, odd Euler characteristic. Empty when nothing. Shares no code with the check
/// of the library.
std::string objection_of_cgal(const geometry::TriangleMesh& mesh);

}  // namespace geocage::tests
