#include "topology/writhe.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

#include "pipeline/error.h"

namespace geocage::topology {

namespace {

/// Solid angle of the triangle x, y, z seen from the origin (Van Oosterom and Strackee 1983).
double solid_angle(const Vec3& x, const Vec3& y, const Vec3& z) {
  const double lx = x.norm(), ly = y.norm(), lz = z.norm();
  return 2 * std::atan2(x.dot(y.cross(z)), lx * ly * lz + x.dot(y) * lz + y.dot(z) * lx + z.dot(x) * ly);
}

}  // namespace

double segment_writhe(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  // The differences between points of the two segments fill the parallelogram p, q, r, s.
  const Vec3 p = c - a, q = d - a, r = d - b, s = c - b;
  const double scale = std::max({p.norm(), q.norm(), r.norm(), s.norm()});
  const double volume = (b - a).dot(p.cross(d - c));
  // Flat parallelogram: segments in one plane, which see nothing of each other.
  if (std::abs(volume) <= 1e-14 * scale * (b - a).norm() * (d - c).norm()) return 0;
  return -(solid_angle(p, q, r) + solid_angle(p, r, s));
}

Eigen::MatrixXd writhe_matrix(const Polyline& first, const Polyline& second) {
  const auto rows = static_cast<Eigen::Index>(first.size()) - 1,
             columns = static_cast<Eigen::Index>(second.size()) - 1;
  Eigen::MatrixXd omega(rows, columns);
  for (Eigen::Index i = 0; i < rows; ++i)
    for (Eigen::Index j = 0; j < columns; ++j)
      omega(i, j) = segment_writhe(first[i], first[i + 1], second[j], second[j + 1]);
  return omega;
}

double gauss_linking_integral(const Polyline& first, const Polyline& second) {
  return writhe_matrix(first, second).sum() / (4 * M_PI);
}

double writhe_of_closed(const Polyline& curve) {
  Polyline closed = curve;
  closed.push_back(curve.front());
  return gauss_linking_integral(closed, closed);  // a segment sees nothing of itself
}

double winding_number(const Polyline& curve, const Vec3& center, const Vec3& normal, Turning turning) {
  double angle = 0;
  for (std::size_t i = 0; i + 1 < curve.size(); ++i) {
    const Vec3 from = curve[i] - center, to = curve[i + 1] - center;
    const Vec3 a = from - normal.dot(from) * normal, b = to - normal.dot(to) * normal;
    const double step = std::atan2(normal.dot(a.cross(b)), a.dot(b));
    angle += turning == Turning::is_signed ? step : std::abs(step);
  }
  return angle / (2 * M_PI);
}

Polyline read_polyline(const std::filesystem::path& file) {
  const auto refuse = [&](const std::string& where, const std::string& sentence) {
    throw pipeline::UserError(pipeline::Fault::input, where, sentence, "a polyline is one x,y,z a line");
  };
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) refuse(file.string(), "there is no such file");
  std::ifstream in(file);
  Polyline points;
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
    std::istringstream cells(line);
    Vec3 p;
    char comma = ',';
    for (int i = 0; i < 3; ++i) {
      if (i > 0 && (!(cells >> comma) || comma != ',')) comma = 0;
      if (!(cells >> p[i])) comma = 0;
    }
    std::string rest;
    if (comma != ',' || cells >> rest || !p.allFinite())
      refuse(file.string() + ":" + std::to_string(number), "'" + line.substr(0, 60) + "' is not x,y,z");
    points.push_back(p);
  }
  if (points.size() < 2) refuse(file.string(), "a polyline needs at least two points");
  return points;
}

}  // namespace geocage::topology
