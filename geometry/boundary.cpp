#include "geometry/boundary.h"

#include <algorithm>
#include <map>
#include <set>

namespace geocage::geometry {

int boundary_loops(const TriangleMesh& mesh) {
  std::map<std::pair<int, int>, int> around;
  for (const auto& t : mesh.triangles)
    for (int i = 0; i < 3; ++i) ++around[std::minmax(t[i], t[(i + 1) % 3])];
  std::map<int, std::vector<int>> next;
  for (const auto& [edge, triangles] : around)
    if (triangles == 1) {
      next[edge.first].push_back(edge.second);
      next[edge.second].push_back(edge.first);
    }
  int loops = 0;
  std::set<int> seen;
  for (const auto& [start, list] : next) {
    if (seen.contains(start)) continue;
    ++loops;
    std::vector<int> open = {start};
    while (!open.empty()) {
      const int at = open.back();
      open.pop_back();
      if (!seen.insert(at).second) continue;
      open.insert(open.end(), next.at(at).begin(), next.at(at).end());
    }
  }
  return loops;
}

}  // namespace geocage::geometry
