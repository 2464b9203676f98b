#include "motion/shortcuts.h"

#include <algorithm>
#include <cmath>

namespace geocage::motion {

using Eigen::VectorXd;

namespace {

constexpr double least_gain = 0.003;  ///< of a piece and of a round, as a share of the path's length
constexpr int most_rounds = 4;
constexpr Eigen::Index all = -1;  ///< coordinates

}  // namespace

double length_of(const Path& path) {
  double length = 0;
  for (std::size_t t = 1; t < path.size(); ++t) length += (path[t] - path[t - 1]).norm();
  return length;
}

Path respaced(const Path& path, int steps) {
  const double length = length_of(path);
  Path even = {path.front()};
  double before = 0;  // of the corner `at`
  std::size_t at = 0;
  for (int t = 1; t < steps; ++t) {
    const double wanted = length * t / steps;
    double piece = (path[at + 1] - path[at]).norm();
    while (before + piece < wanted && at + 2 < path.size()) {
      before += piece;
      ++at;
      piece = (path[at + 1] - path[at]).norm();
    }
    const double share = piece > 0 ? std::clamp((wanted - before) / piece, 0.0, 1.0) : 0;
    even.push_back(path[at] + share * (path[at + 1] - path[at]));
  }
  even.push_back(path.back());
  return even;
}

/// By how much the path gets shorter when the piece, or one coordinate of it, is straight.
double Shortcuts::gain(const Path& path, std::size_t from, std::size_t to, Eigen::Index coordinate) const {
  const double straight =
      coordinate == all ? (path[to] - path[from]).norm() / static_cast<double>(to - from)
                        : (path[to][coordinate] - path[from][coordinate]) / static_cast<double>(to - from);
  double sum = 0;
  for (std::size_t t = from; t < to; ++t) {
    const double length2 = (path[t + 1] - path[t]).squaredNorm();
    sum += std::sqrt(length2);
    if (coordinate == all) {
      sum -= straight;
    } else {
      const double own = path[t + 1][coordinate] - path[t][coordinate];
      sum -= std::sqrt(std::max(0.0, length2 - own * own + straight * straight));
    }
  }
  return sum;
}

/// A proof, but where a look at three postures says that there is none.
bool Shortcuts::frees(const Path& piece, const std::vector<double>& tolerance_m) {
  const std::size_t steps = piece.size() - 1;
  for (const std::size_t quarter : {2, 1, 3}) {
    const std::size_t t = steps * quarter / 4;
    const double share = static_cast<double>(steps * quarter) / 4 - static_cast<double>(t);
    if (prover_.touches(piece[t] + share * (piece[t + 1] - piece[t]), tolerance_m)) return false;
  }
  return prover_.frees(piece, tolerance_m);
}

bool Shortcuts::straighten(Path& path, std::size_t from, std::size_t to, Eigen::Index coordinate,
                           const std::vector<double>& tolerance_m) {
  if (gain(path, from, to, coordinate) < worth_) return false;
  const auto dim = static_cast<std::size_t>(path[from].size()) + 1;
  const std::size_t key = (from * path.size() + to) * dim + static_cast<std::size_t>(coordinate + 1);
  const auto refused = refused_.find(key);
  const auto begin = path.begin() + static_cast<std::ptrdiff_t>(from),
             end = path.begin() + static_cast<std::ptrdiff_t>(to) + 1;
  if (refused != refused_.end() && std::all_of(changed_.begin() + static_cast<std::ptrdiff_t>(from),
                                               changed_.begin() + static_cast<std::ptrdiff_t>(to) + 1,
                                               [&](std::size_t when) { return when < refused->second; }))
    return false;
  ++now_;
  if (coordinate == all) {
    if (!frees({path[from], path[to]}, tolerance_m)) {
      refused_[key] = now_;
      return false;
    }
    for (std::size_t t = from + 1; t < to; ++t)
      path[t] = path[from] +
                static_cast<double>(t - from) / static_cast<double>(to - from) * (path[to] - path[from]);
  } else {
    piece_.assign(begin, end);
    const double first = path[from][coordinate], way = path[to][coordinate] - first;
    for (std::size_t k = 1; k < to - from; ++k)
      piece_[k][coordinate] = first + static_cast<double>(k) / static_cast<double>(to - from) * way;
    if (!frees(piece_, tolerance_m)) {
      refused_[key] = now_;
      return false;
    }
    std::copy(piece_.begin(), piece_.end(), begin);
  }
  std::fill(changed_.begin() + static_cast<std::ptrdiff_t>(from) + 1,
            changed_.begin() + static_cast<std::ptrdiff_t>(to), now_);
  return true;
}

void Shortcuts::cut(Path& path, std::size_t first, std::size_t last, const std::vector<double>& tolerance_m,
                    bool coordinates) {
  for (std::size_t stride = last - first; stride > 2; stride = (stride + 1) / 2)
    for (std::size_t i = first; i + stride <= last; i += stride / 2) {
      if (!coordinates) straighten(path, i, i + stride, all, tolerance_m);
      for (Eigen::Index j = 0; coordinates && j < path[i].size(); ++j)
        straighten(path, i, i + stride, j, tolerance_m);
    }
}

void Shortcuts::close_early(Path& path, std::size_t& free) {
  constexpr std::size_t parts = 8;
  for (std::size_t part = 0; part < parts; ++part) {
    const std::size_t i = (free - 1) * part / parts;
    const Path straight = {path[i], path.back()};
    if (!frees(straight, tolerances_.closing_m)) continue;
    const Path pieces = respaced(straight, static_cast<int>(path.size() - i) - 1);
    std::copy(pieces.begin(), pieces.end(), path.begin() + static_cast<std::ptrdiff_t>(i));
    std::fill(changed_.begin() + static_cast<std::ptrdiff_t>(i) + 1, changed_.end(), ++now_);
    free = i + 1 + static_cast<std::size_t>(prover_.check(pieces, tolerances_.cut_m).steps);
    return;
  }
}

void Shortcuts::shorten(Path& path, std::size_t& free) {
  changed_.assign(path.size(), 0);
  refused_.clear();
  now_ = 0;
  double length = length_of(path);
  for (int round = 0; round < most_rounds; ++round) {
    worth_ = least_gain * length;
    cut(path, 0, free - 1, tolerances_.cut_m, false);
    cut(path, 0, free - 1, tolerances_.cut_m, true);
    close_early(path, free);
    cut(path, free - 1, path.size() - 1, tolerances_.closing_m, false);
    const double now = length_of(path);
    if (now > (1 - least_gain) * length) return;
    length = now;
  }
}

}  // namespace geocage::motion
