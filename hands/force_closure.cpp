#include "hands/force_closure.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <numbers>
#include <stdexcept>
#include <string>

#include <Eigen/SVD>
extern "C" {
#include <libqhull_r/qhull_ra.h>
}

#include "geometry/pose.h"

namespace geocage::hands {

namespace {

constexpr double rank_tolerance = 1e-9;  // of singular values against the largest: far above rounding (1e-15)
constexpr double inside_tolerance = 1e-9;  // of facet offsets: wrenches have lengths near 1

/// Corners of a polyhedron in the unit ball of what friction resists, and how much it must grow to hold the
/// ball. Coordinates: two tangential forces, torsion. Points resist no torsion: a polygon in the unit circle.
/// Soft contacts: rings of the polygon at the latitudes 0 and +-45 degrees, and the poles.
struct Resisted {
  std::vector<Vec3> corners;
  double growth = 1;
};
Resisted resisted(const FrictionModel& model) {
  if (model.mu <= 0) return {{Vec3::Zero()}, 1};
  Resisted all;
  const double side = std::cos(std::numbers::pi / model.edges);  // a polygon's middle of a side
  const auto ring = [&](double radius, double height) {
    for (int j = 0; j < model.edges; ++j) {
      const double at = 2 * std::numbers::pi * j / model.edges;
      all.corners.emplace_back(radius * std::cos(at), radius * std::sin(at), height);
    }
  };
  ring(1, 0);
  all.growth = 1 / side;
  if (model.torsion_m <= 0) return all;
  const double half = std::numbers::sqrt2 / 2;
  ring(half, half);
  ring(half, -half);
  all.corners.emplace_back(0, 0, 1);
  all.corners.emplace_back(0, 0, -1);
  // Faces touch the lines between the rings' sides: their distances from the centre, in the plane of a side.
  const auto away = [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return std::abs(a.x() * b.y() - a.y() * b.x()) / (a - b).norm();
  };
  const Eigen::Vector2d equator(side, 0), middle(half * side, half), pole(0, 1);
  all.growth = 1 / std::min(away(equator, middle), away(middle, pole));
  return all;
}

/// Columns: the wrenches of all corners of all contacts, friction's part times `widen`.
Eigen::MatrixXd wrenches(const std::vector<Contact>& contacts, const FrictionModel& model, WrenchPart part,
                         const std::vector<Vec3>& corners, double widen) {
  const int rows = part == WrenchPart::force ? 3 : 6;
  Eigen::MatrixXd all(rows, static_cast<Eigen::Index>(corners.size() * contacts.size()));
  Eigen::Index column = 0;
  for (const Contact& contact : contacts) {
    const Eigen::Matrix3d frame = geometry::frame_from_z(-contact.n_O);
    for (const Vec3& corner : corners) {
      const Vec3 friction = widen * model.mu * corner;
      const Vec3 f = frame * Vec3(friction.x(), friction.y(), 1);
      all.col(column).head<3>() = f;
      if (rows == 6)
        all.col(column).tail<3>() =
            ((contact.p_O - model.center_O).cross(f) - model.torsion_m * friction.z() * contact.n_O) /
            model.torque_length_m;
      ++column;
    }
  }
  return all;
}

struct Hull {
  double offset = 0;  ///< smallest distance of a facet from the origin, 0 when that is not inside
  double volume = 0;
};

/// Qhull keeps its memory in this; nothing is printed.
struct QhullDeleter {
  void operator()(qhT* qh) const {
    int left = 0, total = 0;
    qh_freeqhull(qh, !qh_ALL);
    qh_memfreeshort(qh, &left, &total);
    delete qh;
  }
};

/// Of the columns and the origin. Precondition: they span the space.
Hull hull_with_origin(const Eigen::MatrixXd& points) {
  std::vector<double> coordinates(points.data(), points.data() + points.size());
  coordinates.insert(coordinates.end(), static_cast<std::size_t>(points.rows()), 0.0);
  std::unique_ptr<qhT, QhullDeleter> qh(new qhT);
  const std::unique_ptr<FILE, int (*)(FILE*)> silence(std::fopen("/dev/null", "w"), &std::fclose);
  qh_zero(qh.get(), silence.get());
  char options[] = "qhull Qt";  // triangulated facets
  const int failed =
      qh_new_qhull(qh.get(), static_cast<int>(points.rows()), static_cast<int>(points.cols()) + 1,
                   coordinates.data(), False, options, nullptr, silence.get());
  if (failed != 0)
    throw std::runtime_error("the hull of the wrenches failed: Qhull's code " + std::to_string(failed));
  double least = std::numeric_limits<double>::infinity();
  for (const facetT* facet = qh->facet_list; facet && facet->next; facet = facet->next)
    least = std::min(least, -facet->offset);
  if (least < inside_tolerance) return {};
  qh_getarea(qh.get(), qh->facet_list);
  return {least, qh->totvol};
}

bool spans(const Eigen::MatrixXd& columns) {
  if (columns.cols() < columns.rows()) return false;
  const auto values = Eigen::JacobiSVD<Eigen::MatrixXd>(columns).singularValues();
  return values[columns.rows() - 1] > rank_tolerance * values[0];
}

}  // namespace

std::string_view name_of(Resistance resistance) {
  switch (resistance) {
    case Resistance::force_closure:
      return "force closure";
    case Resistance::no_contact:
      return "no contact";
    case Resistance::rank_deficient:
      return "rank deficient";
    case Resistance::one_sided:
      return "one-sided";
  }
  return "";
}

ForceClosure force_closure(const std::vector<Contact>& contacts, const FrictionModel& model,
                           WrenchPart part) {
  ForceClosure closure;
  if (contacts.empty()) return closure;
  const Resisted friction = resisted(model);
  const Eigen::MatrixXd inner = wrenches(contacts, model, part, friction.corners, 1);
  if (!spans(inner)) {
    closure.outcome = Resistance::rank_deficient;
    return closure;
  }
  const Hull hull = hull_with_origin(inner);
  closure.outcome = hull.offset > 0 ? Resistance::force_closure : Resistance::one_sided;
  closure.low = hull.offset;
  closure.volume = hull.volume;
  closure.high =
      model.mu > 0
          ? hull_with_origin(wrenches(contacts, model, part, friction.corners, friction.growth)).offset
          : closure.low;
  return closure;
}

}  // namespace geocage::hands
