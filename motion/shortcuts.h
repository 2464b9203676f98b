#pragma once
#include <cstddef>
#include <unordered_map>
#include <vector>

#include "motion/certificate.h"

namespace geocage::motion {

using Path = std::vector<Eigen::VectorXd>;

/// Sum of |x_{t+1} - x_t|.
double length_of(const Path& path);
/// Points of a polyline at equal distances along it, its ends included.
Path respaced(const Path& path, int steps);

/// How deep links may be, by link (Prover::certify).
struct CutTolerances {
  std::vector<double> cut_m;      ///< of what replaces waypoints of the free part
  std::vector<double> closing_m;  ///< of what replaces those after it
};

/// Makes a path shorter where shorter pieces are proven: straight pieces in place of waypoints, long ones
/// first; the same for one coordinate after the other, since some wander while others have to (Geraerts and
/// Overmars 2007, partial shortcuts); and one straight piece to the end from as early as it is proven. Ends
/// and number of waypoints stay. Repeated until a round brings less than a share of the length that is worth
/// it. The prover must outlive it. Deterministic.
class Shortcuts {
 public:
  Shortcuts(Prover& prover, const CutTolerances& tolerances) : prover_(prover), tolerances_(tolerances) {}
  /// `free`: waypoints before this are the free part, which ends at the first contact of a straight closing.
  void shorten(Path& path, std::size_t& free);

 private:
  /// Between two waypoints, of one coordinate or of all.
  void cut(Path& path, std::size_t first, std::size_t last, const std::vector<double>& tolerance_m,
           bool coordinates);
  bool straighten(Path& path, std::size_t from, std::size_t to, Eigen::Index coordinate,
                  const std::vector<double>& tolerance_m);
  bool frees(const Path& piece, const std::vector<double>& tolerance_m);
  void close_early(Path& path, std::size_t& free);
  double gain(const Path& path, std::size_t from, std::size_t to, Eigen::Index coordinate) const;

  Prover& prover_;
  const CutTolerances tolerances_;
  double worth_ = 0;                                      ///< least gain of a piece
  std::size_t now_ = 0;                                   ///< counts pieces that were tried
  std::vector<std::size_t> changed_;                      ///< when each waypoint was, last
  std::unordered_map<std::size_t, std::size_t> refused_;  ///< pieces, and when
  Path piece_;
};

}  // namespace geocage::motion
