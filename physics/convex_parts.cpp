#include "physics/convex_parts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <numeric>

#include <LinearMath/btConvexHullComputer.h>

namespace geocage::physics {
namespace {

using geometry::SignedDistanceField;
using geometry::Vec3;
using Box = Eigen::AlignedBox3d;
using Polygon = std::vector<Vec3>;

/// The part of a convex polygon where side * (p[axis] - at) <= 0 (Sutherland and Hodgman 1974).
Polygon clipped(const Polygon& polygon, int axis, double at, double side) {
  Polygon kept;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vec3 &p = polygon[i], &q = polygon[(i + 1) % polygon.size()];
    const double dp = side * (p[axis] - at), dq = side * (q[axis] - at);
    if (dp <= 0) kept.push_back(p);
    if ((dp < 0 && dq > 0) || (dp > 0 && dq < 0)) {
      kept.push_back(p + dp / (dp - dq) * (q - p));
      kept.back()[axis] = at;
    }
  }
  return kept;
}

/// The corners of the solid within the box.
std::vector<Vec3> corners_within(const geometry::TriangleMesh& mesh, const std::vector<int>& triangles,
                                 const SignedDistanceField& field, const Box& box) {
  std::vector<Vec3> points;
  for (const int t : triangles) {
    Polygon polygon;
    for (const int v : mesh.triangles[t]) polygon.push_back(mesh.vertices[v]);
    for (int axis = 0; axis < 3 && !polygon.empty(); ++axis) {
      polygon = clipped(polygon, axis, box.max()[axis], 1);
      polygon = clipped(polygon, axis, box.min()[axis], -1);
    }
    points.insert(points.end(), polygon.begin(), polygon.end());
  }
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 p = box.corner(static_cast<Box::CornerType>(corner));
    if (field.value(p) < 0) points.push_back(p);
  }
  return points;
}

/// Empty for points that span no volume. `middles`: gets those of edges and faces.
ConvexPart hull_of(const std::vector<Vec3>& points, std::vector<Vec3>* middles = nullptr) {
  ConvexPart part;
  if (points.size() < 4) return part;
  btConvexHullComputer computer;
  std::vector<double> flat;
  for (const Vec3& p : points) flat.insert(flat.end(), p.data(), p.data() + 3);
  computer.compute(flat.data(), 3 * sizeof(double), static_cast<int>(points.size()), 0, 0);
  // The points themselves: the computer's are rounded to a ten-thousandth of the size, anew in every merge.
  for (int i = 0; i < computer.vertices.size(); ++i)
    part.vertices_O.push_back(points[static_cast<std::size_t>(computer.original_vertex_index[i])]);
  Vec3 center = Vec3::Zero();
  for (const Vec3& p : part.vertices_O) center += p / static_cast<double>(part.vertices_O.size());
  for (int f = 0; f < computer.faces.size(); ++f) {
    const auto* first = &computer.edges[computer.faces[f]];
    const auto* edge = first;
    Vec3 normal = Vec3::Zero();  // Newell: twice the area, whatever the corners' number
    Vec3 sum = Vec3::Zero();
    int corners = 0;
    do {
      const Vec3 &p = part.vertices_O[edge->getSourceVertex()], &q = part.vertices_O[edge->getTargetVertex()];
      normal += (p - center).cross(q - center);
      sum += p, ++corners;
      if (middles && edge->getSourceVertex() < edge->getTargetVertex()) middles->push_back((p + q) / 2);
      edge = edge->getNextEdgeOfFace();
    } while (edge != first);
    if (middles) middles->push_back(sum / corners);
    if (normal.norm() < 1e-14) continue;
    normal.normalize();
    if (normal.dot(part.vertices_O[first->getSourceVertex()] - center) < 0) normal = -normal;
    double offset = -1e300;
    for (const Vec3& p : part.vertices_O) offset = std::max(offset, normal.dot(p));
    part.normals_O.push_back(normal), part.offset_m.push_back(offset);
  }
  if (part.normals_O.size() < 4) return {};
  return part;
}

Box box_of(const std::vector<Vec3>& points) {
  Box box;
  for (const Vec3& p : points) box.extend(p);
  return box;
}

/// A convex part and a box that shrinks: of the part's faces, those that may cut the box.
class Cuts {
 public:
  explicit Cuts(const ConvexPart& part) : part_(part), faces_(part.normals_O.size()) {
    std::iota(faces_.begin(), faces_.end(), std::size_t(0));
  }
  /// Of what `whole` has beyond the part: without the faces that all of `whole` is behind, to 1 um.
  Cuts(const ConvexPart& part, const ConvexPart& whole) : part_(part) {
    constexpr double same_m = 1e-6;
    for (std::size_t face = 0; face < part.normals_O.size(); ++face)
      if (std::ranges::any_of(whole.vertices_O, [&](const Vec3& p) {
            return part.normals_O[face].dot(p) > part.offset_m[face] + same_m;
          }))
        faces_.push_back(face);
  }

  enum Side { apart, across, inside };
  /// Where the box lies. From now on, only the faces that may cut it are looked at, until `back`.
  Side shrink(const Vec3& middle, const Vec3& half, bool& holds_middle) {
    const std::size_t past = faces_.size();
    begins_.push_back(first_);
    holds_middle = true;
    for (std::size_t i = first_; i < past; ++i) {
      const std::size_t face = faces_[i];
      const double beyond = part_.normals_O[face].dot(middle) - part_.offset_m[face],
                   reach = part_.normals_O[face].cwiseAbs().dot(half);
      if (beyond > reach) {
        first_ = past, faces_.resize(past), ends_.push_back(past);
        return apart;
      }
      holds_middle = holds_middle && beyond <= 0;
      if (beyond > -reach) faces_.push_back(face);
    }
    first_ = past, ends_.push_back(past);
    return faces_.size() == past ? inside : across;
  }
  void back() {
    faces_.resize(ends_.back());
    first_ = begins_.back();
    begins_.pop_back(), ends_.pop_back();
  }

 private:
  const ConvexPart& part_;
  std::vector<std::size_t> faces_, begins_, ends_;
  std::size_t first_ = 0;
};

/// Whether a part is nowhere farther outside the solid than the tolerance. A box around the part is halved
/// where it holds points of the part and its middle is nearer to the tolerance than its corners are to the
/// middle: distances grow by no more than the way.
class Outline {
 public:
  Outline(const SignedDistanceField& field, const ConvexPartsRule& rule)
      : field_(field), look_m_(rule.look_m), limit_m_(rule.tolerance_m - std::sqrt(0.75) * rule.look_m) {}

  /// `known`: parts of the part that are within.
  bool within(const ConvexPart& part, std::initializer_list<const ConvexPart*> known = {}) const {
    Search search{Cuts(part), {}};
    for (const ConvexPart* of : known) search.known.emplace_back(*of, part);
    const Box box = box_of(part.vertices_O);
    return within(search, box.center(), box.sizes() / 2, field_.value(box.center()), ~0u);
  }

  bool beyond(const std::vector<Vec3>& points) const {
    return std::ranges::any_of(points, [&](const Vec3& p) { return field_.value(p) > limit_m_; });
  }

  /// Whether the middle between two corners of the parts shows already that the hull of both is not within.
  bool parted(const ConvexPart& a, const ConvexPart& b) const {
    constexpr std::size_t looks = 8;  // of each part's corners
    for (std::size_t i = 0; i < looks; ++i)
      for (std::size_t j = 0; j < looks; ++j) {
        const Vec3 &p = a.vertices_O[i * a.vertices_O.size() / looks],
                   &q = b.vertices_O[j * b.vertices_O.size() / looks];
        if (field_.value((p + q) / 2) > limit_m_) return true;
      }
    return false;
  }

 private:
  struct Search {
    Cuts part;
    std::vector<Cuts> known;
  };

  /// `outside_m`: the field at the middle. `near`: a bit for each known part that the box may meet.
  bool within(Search& search, const Vec3& middle, const Vec3& half, double outside_m, unsigned near) const {
    if (outside_m + half.norm() <= limit_m_) return true;
    bool in_part = false, in_known = false, done = false;
    const Cuts::Side side = search.part.shrink(middle, half, in_part);
    unsigned nearer = 0;
    if (side != Cuts::apart)
      for (std::size_t i = 0; i < search.known.size() && !done; ++i)
        if (near >> i & 1) {
          const Cuts::Side of_known = search.known[i].shrink(middle, half, in_known);
          done = of_known == Cuts::inside;
          if (of_known == Cuts::apart || done)
            search.known[i].back();
          else
            nearer |= 1u << i;
        }
    const bool answer =
        side == Cuts::apart || done || halves_within(search, middle, half, outside_m, nearer, in_part);
    for (std::size_t i = 0; i < search.known.size(); ++i)
      if (nearer >> i & 1) search.known[i].back();
    search.part.back();
    return answer;
  }

  bool halves_within(Search& search, const Vec3& middle, const Vec3& half, double outside_m, unsigned near,
                     bool in_part) const {
    if (in_part && outside_m > limit_m_) return false;
    int axis = 0;
    if (half.maxCoeff(&axis) <= look_m_ / 2) return true;
    Vec3 smaller = half, step = Vec3::Zero();
    step[axis] = smaller[axis] /= 2;
    // What is too far outside is found sooner in the half that is farther.
    const double low_m = field_.value(middle - step), high_m = field_.value(middle + step);
    if (low_m < high_m) step = -step;
    return within(search, middle - step, smaller, std::max(low_m, high_m), near) &&
           within(search, middle + step, smaller, std::min(low_m, high_m), near);
  }

  const SignedDistanceField& field_;
  double look_m_, limit_m_;
};

struct Piece {
  Box box;
  ConvexPart part;
  int changed = 0;  ///< in this round of merging
};

struct Cutter {
  const geometry::TriangleMesh& mesh;
  const SignedDistanceField& field;
  const ConvexPartsRule& rule;
  Outline outline;
  std::vector<Piece> pieces;

  void cut(const Box& box, const std::vector<int>& triangles) {
    std::vector<int> inside;
    for (const int t : triangles) {
      const auto& corners = mesh.triangles[t];
      if (box.intersects(
              box_of({mesh.vertices[corners[0]], mesh.vertices[corners[1]], mesh.vertices[corners[2]]})))
        inside.push_back(t);
    }
    ConvexPart part = hull_of(corners_within(mesh, inside, field, box));
    if (part.normals_O.empty()) return;
    int axis = 0;
    const double longest = box.sizes().maxCoeff(&axis);
    if (longest < 2 * rule.smallest_box_m || outline.within(part)) {
      pieces.push_back({box, std::move(part), 0});
      return;
    }
    Box low = box, high = box;
    low.max()[axis] = high.min()[axis] = box.center()[axis];
    cut(low, inside);
    cut(high, inside);
  }

  void merge() {
    bool merged = true;
    for (int round = 1; merged; ++round) {
      merged = false;
      for (std::size_t i = 0; i < pieces.size(); ++i)
        for (std::size_t j = i + 1; j < pieces.size();) {
          const bool tried = std::max(pieces[i].changed, pieces[j].changed) < round - 1;
          if (tried || pieces[i].box.exteriorDistance(pieces[j].box) > 1e-9 ||
              outline.parted(pieces[i].part, pieces[j].part)) {
            ++j;
            continue;
          }
          std::vector<Vec3> points = pieces[i].part.vertices_O;
          points.insert(points.end(), pieces[j].part.vertices_O.begin(), pieces[j].part.vertices_O.end());
          std::vector<Vec3> middles;
          ConvexPart both = hull_of(points, &middles);
          if (both.normals_O.empty() || outline.beyond(middles) ||
              !outline.within(both, {&pieces[i].part, &pieces[j].part})) {
            ++j;
            continue;
          }
          pieces[i] = {pieces[i].box.merged(pieces[j].box), std::move(both), round};
          pieces.erase(pieces.begin() + static_cast<long>(j));
          merged = true;
        }
    }
  }
};

}  // namespace

bool ConvexPart::contains(const Vec3& p_O, double margin_m) const {
  for (std::size_t i = 0; i < normals_O.size(); ++i)
    if (normals_O[i].dot(p_O) > offset_m[i] + margin_m) return false;
  return !normals_O.empty();
}

std::vector<ConvexPart> convex_parts(const geometry::TriangleMesh& mesh, const SignedDistanceField& field,
                                     const ConvexPartsRule& rule) {
  Cutter cutter{mesh, field, rule, {field, rule}, {}};
  std::vector<int> all(mesh.triangles.size());
  for (std::size_t t = 0; t < all.size(); ++t) all[t] = static_cast<int>(t);
  cutter.cut(box_of(mesh.vertices), all);
  cutter.merge();
  std::vector<ConvexPart> parts;
  for (Piece& piece : cutter.pieces) parts.push_back(std::move(piece.part));
  return parts;
}

Eigen::Array3i lattice_of(const Box& box_O, double step_m) {
  return (box_O.sizes() / step_m).array().ceil().cast<int>();
}

std::vector<bool> covered_points(const Box& box_O, double step_m, const std::vector<ConvexPart>& parts) {
  const Eigen::Array3i n = lattice_of(box_O, step_m);
  std::vector<bool> covered(static_cast<std::size_t>(n.x()) * n.y() * n.z());
  for (const ConvexPart& part : parts) {
    const Box box = box_of(part.vertices_O);
    const auto place = [&](const Vec3& p) {
      return ((p - box_O.min()) / step_m).array().floor().cast<int>().eval();
    };
    const Eigen::Array3i low = place(box.min()).max(0), high = place(box.max()).min(n - 1);
    for (int z = low.z(); z <= high.z(); ++z)
      for (int y = low.y(); y <= high.y(); ++y)
        for (int x = low.x(); x <= high.x(); ++x) {
          auto&& here = covered[(static_cast<std::size_t>(z) * n.y() + y) * n.x() + x];
          here = here || part.contains(box_O.min() + step_m * Vec3(x + 0.5, y + 0.5, z + 0.5), 1e-9);
        }
  }
  return covered;
}

VoxelShape voxel_shape(const Box& box_O, double cell_m, const std::function<bool(const Vec3&)>& inside) {
  // A border of empty cells; corner (x, y, z) of the lattice is the low corner of cell (x, y, z).
  const Eigen::Array3i n = (box_O.sizes() / cell_m).array().ceil().cast<int>() + 3;
  const auto index = [&](int x, int y, int z) {
    return (static_cast<std::size_t>(z) * n.y() + y) * n.x() + x;
  };
  std::vector<std::uint8_t> full(static_cast<std::size_t>(n.x()) * n.y() * n.z(), 0);
  VoxelShape shape;
  long cells = 0;
  for (int z = 1; z + 1 < n.z(); ++z)
    for (int y = 1; y + 1 < n.y(); ++y)
      for (int x = 1; x + 1 < n.x(); ++x)
        if (inside(box_O.min() + cell_m * Vec3(x - 0.5, y - 0.5, z - 0.5))) full[index(x, y, z)] = 1, ++cells;
  long vertices = 0, edges = 0, faces = 0;
  for (int z = 1; z < n.z(); ++z)
    for (int y = 1; y < n.y(); ++y)
      for (int x = 1; x < n.x(); ++x) {
        const auto any = [&](int dx, int dy, int dz) {  // of the cells that share the element
          for (int k = 0; k <= dz; ++k)
            for (int j = 0; j <= dy; ++j)
              for (int i = 0; i <= dx; ++i)
                if (full[index(x - i, y - j, z - k)]) return 1;
          return 0;
        };
        vertices += any(1, 1, 1);
        edges += any(0, 1, 1) + any(1, 0, 1) + any(1, 1, 0);
        faces += any(1, 0, 0) + any(0, 1, 0) + any(0, 0, 1);
      }
  shape.euler = vertices - edges + faces - cells;
  shape.volume_m3 = static_cast<double>(cells) * cell_m * cell_m * cell_m;

  std::vector<std::array<int, 3>> stack;
  for (int z = 1; z + 1 < n.z(); ++z)
    for (int y = 1; y + 1 < n.y(); ++y)
      for (int x = 1; x + 1 < n.x(); ++x) {
        if (full[index(x, y, z)] != 1) continue;
        ++shape.pieces;
        full[index(x, y, z)] = 2;
        stack.push_back({x, y, z});
        while (!stack.empty()) {
          const auto [a, b, c] = stack.back();
          stack.pop_back();
          for (int k = -1; k <= 1; ++k)
            for (int j = -1; j <= 1; ++j)
              for (int i = -1; i <= 1; ++i) {
                auto& cell = full[index(a + i, b + j, c + k)];
                if (cell == 1) cell = 2, stack.push_back({a + i, b + j, c + k});
              }
        }
      }
  return shape;
}

VoxelShape voxel_shape(const Box& box_O, double cell_m, const std::vector<ConvexPart>& parts) {
  Box box = box_O;
  box.max() += Vec3::Constant(2 * cell_m);  // the last cells' middles may lie beyond
  const std::vector<bool> covered = covered_points(box, cell_m, parts);
  const Eigen::Array3i n = lattice_of(box, cell_m);
  return voxel_shape(box_O, cell_m, [&](const Vec3& p) {
    const Eigen::Array3i at = ((p - box.min()) / cell_m).array().floor().cast<int>();
    return covered[(static_cast<std::size_t>(at.z()) * n.y() + at.y()) * n.x() + at.x()];
  });
}

FaithfulParts faithful_parts(const geometry::TriangleMesh& mesh, const SignedDistanceField& field,
                             double tolerance_m, double voxel_m, double least_m) {
  const Box box = box_of(mesh.vertices);
  const VoxelShape solid = voxel_shape(box, voxel_m, [&](const Vec3& p) { return field.value(p) < 0; });
  FaithfulParts found;
  for (double tolerance = tolerance_m; !found.faithful && tolerance >= least_m; tolerance /= 2) {
    found.tolerance_m = tolerance;
    found.parts = convex_parts(mesh, field, parts_within(tolerance));
    const VoxelShape shape = voxel_shape(box, voxel_m, found.parts);
    found.faithful = shape.euler == solid.euler && shape.pieces == solid.pieces;
  }
  return found;
}

}  // namespace geocage::physics
