#include "topology/lane_balls.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <memory>
#include <new>
#include <span>

#include <Eigen/Eigenvalues>
#include <omp.h>

#include "topology/ball_axes.h"
#include "topology/ball_region.h"
#include "topology/ball_walk.h"
#include "topology/plain_balls.h"

namespace geocage::topology {

using geometry::TriangleMesh;

namespace {

constexpr int most_hops = 254;  // a byte of hops; 255 is farther

/// Memory aligned to a row.
template <class T>
class Aligned {
 public:
  T* at_least(std::size_t count) {
    if (count > count_) {
      data_.reset();  // never both at once
      data_.reset(static_cast<T*>(::operator new(count * sizeof(T), std::align_val_t(128))));
      count_ = count;
    }
    return data_.get();
  }
  T* data() const { return data_.get(); }

 private:
  struct Free {
    void operator()(T* p) const { ::operator delete(p, std::align_val_t(128)); }
  };
  std::unique_ptr<T, Free> data_;
  std::size_t count_ = 0;
};

/// A mesh laid out, whatever will be asked.
struct Ground {
  BallMesh mesh;
  const VertexGrid grid;
  Patches patches;

  explicit Ground(const TriangleMesh& m) : mesh(m), grid(mesh), patches(mesh) {
    std::vector<float>().swap(mesh.longest_m);  // the grid has it
  }
};

/// What is asked, and its answer.
struct Job {
  const BallMesh& mesh;
  const Metric metric;
  const BallOptions& options;
  std::vector<int> hop_limits;
  double largest_m = 0;
  LinkWeights link_weights;
  std::vector<std::uint32_t> length_limits, length_slacks;  ///< of each radius
  BallSet& set;

  Job(const BallMesh& m, Metric used_metric, const BallOptions& o, BallSet& out)
      : mesh(m), metric(used_metric), options(o), set(out) {
    for (const BallFields& ball : set.radii) largest_m = std::max(largest_m, ball.radius_m);
    if (metric == Metric::hop)
      count_hops();
    else
      measure_lengths();
  }

 private:
  void count_hops() {
    for (const BallFields& ball : set.radii) {
      const double hops = mesh.mean_edge_m > 0 ? ball.radius_m * radius_slack / mesh.mean_edge_m : 0;
      hop_limits.push_back(static_cast<int>(std::min(hops, 1e9)));
    }
  }

  /// Whole quanta, 2^30 of them to the largest radius. A path of n edges is off by at most n / 2 quanta, and
  /// n is at most the radius over the shortest edge, or 1.01 times that where the edges' rounding makes a
  /// path of more edges the shortest (edges of 64 quanta at least): nearer to the radius than that, an exact
  /// search decides. Two quanta more for the rounding of the limit.
  void measure_lengths() {
    const double quantum_m = std::max(largest_m, 1e-300) * 0x1p-30;
    double shortest = largest_m;
    link_weights.of_link.resize(mesh.links.neighbour.size());
#pragma omp parallel for schedule(static) reduction(min : shortest)
    for (int v = 0; v < mesh.count; ++v)
      for (int i = mesh.link_start[v]; i < mesh.link_start[v + 1]; ++i) {
        if (mesh.links.neighbour[i] == mesh.count) continue;
        const double length = (mesh.position(v) - mesh.position(mesh.links.neighbour[i])).norm();
        shortest = std::min(shortest, length);
        link_weights.of_link[i] = quanta(length / quantum_m);
      }
    link_weights.mean = quanta(mesh.mean_edge_m / quantum_m);
    link_weights.longest = quanta(mesh.longest_edge_m / quantum_m);
    for (const BallFields& ball : set.radii) {
      const double most_edges = ball.radius_m / std::max(shortest, 1e-300);
      length_slacks.push_back(most_edges > 0x1p24 ? 1u << 29
                                                  : static_cast<std::uint32_t>(3 + 0.51 * most_edges));
      length_limits.push_back(static_cast<std::uint32_t>(ball.radius_m * radius_slack / quantum_m));
    }
  }

  /// Edges longer than the largest radius count as long as that: a plain search decides what they reach.
  static std::uint32_t quanta(double x) {
    return static_cast<std::uint32_t>(std::lround(std::min(x, 0x1p30)));
  }
};

/// The mask of one vertex: which balls of a patch hold it.
using Words [[gnu::vector_size(16)]] = std::uint64_t;
static_assert(sizeof(Words) == sizeof(std::uint64_t) * mask_words);

/// One thread's desk: the balls of a patch.
class PatchBalls {
 public:
  explicit PatchBalls(const Ground& ground)
      : mesh_(ground.mesh), region_(ground.mesh), exact_(ground.mesh), walker_(ground.mesh, ground.grid) {}

  void begin(Job& job) {
    job_ = &job;
    masks_.resize(job.set.radii.size());
    too_far.clear();
    searched_exactly = walker_.searched_whole = 0;
  }

  void run(std::span<const int> patch) {
    sources_ = patch.data();
    count_ = static_cast<int>(patch.size());
    for (int w = 0; w < mask_words; ++w) too_far_[w] = 0;
    if (job_->metric == Metric::hop)
      grow_hops();
    else
      grow_lengths();
    add_up();
    correct_sums();
    for (std::size_t q = 0; q < job_->set.radii.size(); ++q) {
      tasks_.clear();
      principal_axes(sums(q, 0), count_, job_->options.eigenvalue_ratio_guard, axes_);
      for (int l = 0; l < count_; ++l) {
        if (too_far_[l / 64] >> (l % 64) & 1)
          too_far.push_back(mesh_.original[sources_[l]]);
        else
          finish(q, l);
      }
      measure_sections(job_->set.radii[q]);
    }
  }

  std::vector<int> too_far;  ///< vertices of the mesh that are left to the plain way
  int searched_exactly = 0;
  int searched_whole() const { return walker_.searched_whole; }

 private:
  std::uint64_t* masks(std::size_t q) {
    return masks_[q].data() + mask_words;
  }  ///< of vertex 0; before it: outside

  /// The masks of radius q reach as far as `distance` from the patch; beyond they are zero.
  void make_masks(const std::vector<std::uint32_t>& distances) {
    const std::size_t words = (static_cast<std::size_t>(region_.size()) + 1) * mask_words;
    end_.resize(masks_.size());
    for (std::size_t q = 0; q < masks_.size(); ++q) {
      end_[q] = region_.size_within(distances[q]);
      std::uint64_t* mask = masks_[q].at_least(words);
      std::fill_n(mask, mask_words, 0);
      std::fill(mask + (static_cast<std::size_t>(end_[q]) + 1) * mask_words, mask + words, 0);
    }
    dirty_.resize(static_cast<std::size_t>(region_.size()));
  }

  void grow_hops() {
    const int most = *std::max_element(job_->hop_limits.begin(), job_->hop_limits.end());
    const int depth = std::min(most, most_hops);
    region_.grow_by_hops(sources_, count_, depth);
    reaches_.clear();
    for (int limit : job_->hop_limits)
      reaches_.push_back(static_cast<std::uint32_t>(std::min(limit, most_hops)));
    make_masks(reaches_);
    std::uint8_t* rows = rows_.at_least(static_cast<std::size_t>(region_.size()) * lanes);
    hop_rows(region_.view(), depth, rows, dirty_.data());
    for (std::size_t q = 0; q < masks_.size(); ++q)
      hop_masks(rows, end_[q], std::min(job_->hop_limits[q], most_hops), masks(q));
    if (most <= most_hops) return;
    // More hops than a byte holds: good enough where the surface ends before that.
    const bool ends = region_.rings() <= depth;
    for (std::ptrdiff_t i = 0; i < region_.size(); ++i)
      for (int l = 0; l < count_; ++l)
        if (!ends || rows[i * lanes + l] > most_hops) too_far_[l / 64] |= std::uint64_t{1} << (l % 64);
  }

  void grow_lengths() {
    reaches_.clear();
    for (std::size_t q = 0; q < masks_.size(); ++q)
      reaches_.push_back(job_->length_limits[q] + job_->length_slacks[q]);
    const std::uint32_t farthest = *std::max_element(reaches_.begin(), reaches_.end());
    region_.grow_by_length(sources_, count_, farthest, job_->link_weights);
    make_masks(reaches_);
    auto* rows = reinterpret_cast<std::uint32_t*>(
        rows_.at_least(static_cast<std::size_t>(region_.size()) * length_lanes * sizeof(std::uint32_t)));
    undecided_.assign(masks_.size(), {});
    std::uint64_t any_undecided[mask_words] = {};
    for (int first = 0; first < lanes; first += length_lanes) {
      if (first < count_) length_rows(region_.view(), farthest, first, rows, dirty_.data());
      for (std::size_t q = 0; q < masks_.size(); ++q) {
        if (first >= count_) {
          for (std::ptrdiff_t i = 0; i < end_[q]; ++i)
            reinterpret_cast<std::uint32_t*>(masks(q) + i * mask_words)[first / length_lanes] = 0;
          continue;
        }
        const std::uint32_t limit = job_->length_limits[q], slack = std::min(job_->length_slacks[q], limit);
        const std::uint64_t close = length_masks(rows, end_[q], limit, slack, first / length_lanes, masks(q));
        undecided_[q][first / 64] |= close << (first % 64);
        any_undecided[first / 64] |= close << (first % 64);
      }
    }
    for_lanes(any_undecided, [&](int l) { search_exactly(l); });
  }

  /// A vertex of the lane is nearer to some radii than whole quanta can tell: there lengths as doubles
  /// decide.
  void search_exactly(int lane) {
    ++searched_exactly;
    const std::uint64_t bit = std::uint64_t{1} << (lane % 64);
    const auto reach_m = [&](std::size_t q) { return job_->set.radii[q].radius_m * radius_slack; };
    const auto is_open = [&](std::size_t q) { return (undecided_[q][lane / 64] & bit) != 0; };
    double farthest_m = 0;
    for (std::size_t q = 0; q < masks_.size(); ++q)
      if (is_open(q)) farthest_m = std::max(farthest_m, reach_m(q));
    const auto& found = exact_.run(sources_[lane], farthest_m);
    for (std::size_t q = 0; q < masks_.size(); ++q) {
      if (!is_open(q)) continue;
      std::uint64_t* words = masks(q) + lane / 64;
      for (std::ptrdiff_t i = 0; i < end_[q]; ++i) words[i * mask_words] &= ~bit;
      for (const auto& [distance_m, vertex] : found) {
        if (distance_m > reach_m(q)) break;
        words[static_cast<std::ptrdiff_t>(region_.slot()[vertex] - 1) * mask_words] |= bit;
      }
    }
  }

  void add_up() {
    ranges_.clear();
    for (std::size_t q = 0; q < masks_.size(); ++q) ranges_.push_back({masks(q), common_inside(q), end_[q]});
    const Vec3 origin = mesh_.position(sources_[0]);
    const SumInput input{region_.size(),
                         region_.order(),
                         &mesh_.points[0].x,
                         region_.own().data(),
                         {origin.x(), origin.y(), origin.z()}};
    lane_sums(input, static_cast<int>(masks_.size()), ranges_.data(),
              sums_.at_least(masks_.size() * lanes * sum_slots));
  }

  double* sums(std::size_t q, int lane) { return sums_.data() + (q * lanes + lane) * sum_slots; }

  template <class Bits, class Each>
  static void for_lanes(const Bits& bits, const Each& each) {
    for (int w = 0; w < mask_words; ++w)
      for (std::uint64_t left = bits[w]; left != 0; left &= left - 1) each(64 * w + std::countr_zero(left));
  }

  /// The sums took every cell whose last corner is in the ball; those of them with another corner outside go.
  /// And an edge of the ball without a triangle of it, and a vertex without one, are no part of the surface.
  /// Both concern only vertices with a neighbour outside of some ball: most have all theirs in all balls, or
  /// are in none. Nor is there anything to do where the ball has all neighbours before a vertex and these are
  /// one chain of triangles. All radii of one vertex after the other, while its neighbours are at hand.
  void correct_sums() {
    int innermost = region_.size(), outermost = 0;
    for (const MaskRange& range : ranges_) {
      innermost = std::min(innermost, range.inside);
      outermost = std::max(outermost, range.end);
    }
    const RegionView region = region_.view();
    for (int i = 0; i < outermost; ++i) {
      const int farthest = region_.farthest()[i];
      if (farthest < innermost) continue;
      const OwnCells& cells = region_.own()[i];
      const bool chain = cells.euler == 0 && cells.triangles > 0;
      bool known = false;
      for (std::size_t q = 0; q < ranges_.size(); ++q) {
        if (farthest < ranges_[q].inside || i >= ranges_[q].end) continue;
        const Words own = mask_at(q, i + 1);
        if (!any(own)) continue;
        Words missing{};
        for (int n = region.start[i]; n < region.middle[i]; ++n)
          missing |= own & ~mask_at(q, region.near[n] + 1);
        if (chain && !any(missing)) continue;
        if (!known) look_round(i);
        known = true;
        correct_at(q, i, own, any(missing));
      }
    }
  }

  /// The slots of a vertex' ring, cyclic: its last one stands before its first one, and that after it.
  void look_round(int i) {
    const int v = region_.order()[i];
    const int first = mesh_.link_start[v], links = mesh_.link_start[v + 1] - first;
    ring_.resize(static_cast<std::size_t>(links) + 2);
    int* ring = ring_.data();
    for (int k = 0; k < links; ++k) ring[k + 1] = region_.slot()[mesh_.links.neighbour[first + k]];
    ring[0] = ring[links];
    ring[links + 1] = ring[1];
  }
  /// Whether a slot is that of a vertex before the i-th.
  static bool is_lower(int slot, int i) { return static_cast<unsigned>(slot - 1) < static_cast<unsigned>(i); }

  Words mask_at(std::size_t q, int slot) const {
    Words words;
    std::memcpy(&words, masks_[q].data() + static_cast<std::ptrdiff_t>(slot) * mask_words, sizeof(words));
    return words;
  }
  static bool any(Words words) { return (words[0] | words[1]) != 0; }

  void correct_at(std::size_t q, int i, Words own, bool missing) {
    Words used{}, loose{};
    const int *ring = ring_.data(), *const last = ring + ring_.size() - 1;
    Words before = mask_at(q, ring[0]), here = mask_at(q, ring[1]);
    for (++ring; ring < last; ++ring) {
      const Words after = mask_at(q, ring[1]);
      used |= here & after;
      loose |= here & ~before & ~after;
      before = here;
      here = after;
    }
    if (missing) take_missing(q, i, own);
    if (any(own & ~used)) for_lanes(own & ~used, [&](int l) { sums(q, l)[slot_euler] -= 1; });
    if (any(own & loose)) take_loose(q, i, own);
  }

  /// How many vertices from the first on are in all balls.
  int common_inside(std::size_t q) {
    const std::uint64_t* mask = masks(q);
    std::uint64_t full[mask_words];
    for (int w = 0; w < mask_words; ++w) full[w] = mask[w];
    int i = 0;
    while (i < end_[q] && mask[mask_words * static_cast<std::ptrdiff_t>(i)] == full[0] &&
           mask[mask_words * static_cast<std::ptrdiff_t>(i) + 1] == full[1])
      ++i;
    for (int l = 0; l < count_ && i > 0; ++l)
      if (!(full[l / 64] >> (l % 64) & 1)) i = 0;
    return i;
  }

  /// Edges and triangles to neighbours before it that a ball does not hold. Along a chain of these, chi grows
  /// by one for each lost edge and falls for each lost triangle, which leaves its first edge, if lost, and
  /// what is lost before something that is not.
  void take_missing(std::size_t q, int i, Words own) {
    const int first = mesh_.link_start[region_.order()[i]];
    const auto links = static_cast<int>(ring_.size()) - 2;
    double* const sums_here = sums(q, 0);
    Words more{}, before{};
    const auto count = [&](Words bits, int by) {
      for_lanes(bits,
                [&](int l) { sums_here[static_cast<std::ptrdiff_t>(l) * sum_slots + slot_euler] += by; });
    };
    bool after_lower = is_lower(ring_[0], i) && links > 2;
    if (after_lower) before = own & ~mask_at(q, ring_[0]);
    for (int k = 1; k <= links; ++k) {
      if (!is_lower(ring_[k], i)) {
        after_lower = false;
        continue;
      }
      const Words lost = own & ~mask_at(q, ring_[k]);
      if (after_lower) {
        const Words fewer = before & ~lost;
        if (any(fewer & ~more)) count(fewer & ~more, -1);
        more &= ~fewer;
        const double area = mesh_.links.area_m2[first + (k == 1 ? links - 1 : k - 2)];
        for_lanes(before | lost, [&](int l) {
          double* sum = sums_here + static_cast<std::ptrdiff_t>(l) * sum_slots;
          sum[slot_triangles] -= 1;
          sum[slot_area] -= area;
        });
      } else {
        if (any(more & lost)) count(more & lost, 1);
        more |= lost;
      }
      before = lost;
      after_lower = true;
    }
    if (any(more)) count(more, 1);
  }

  /// chi counts the triangles' own edges and corners; a loose edge goes at its later end.
  void take_loose(std::size_t q, int i, Words own) {
    for (std::size_t k = 1; k + 1 < ring_.size(); ++k) {
      if (!is_lower(ring_[k], i)) continue;
      const Words before = mask_at(q, ring_[k - 1]), after = mask_at(q, ring_[k + 1]);
      for_lanes(own & mask_at(q, ring_[k]) & ~before & ~after, [&](int l) { sums(q, l)[slot_euler] += 1; });
    }
  }

  void finish(std::size_t q, int l) {
    BallFields& out = job_->set.radii[q];
    const int rank = sources_[l], v = mesh_.original[rank];
    const double* sum = sums(q, l);
    const bool alone = sum[slot_count] == 1;
    out.ball_vertices[v] = static_cast<int>(sum[slot_count]);
    out.ball_triangles[v] = static_cast<int>(sum[slot_triangles]);
    out.euler[v] = static_cast<int>(sum[slot_euler]);
    out.ball_area_m2[v] = out.ball_triangles[v] > 0 ? sum[slot_area] : 0;
    out.curvature_sum_rad[v] = alone ? mesh_.points[rank].defect_rad : sum[slot_defect];
    const Vec3 mean(axes_.mean[0][l], axes_.mean[1][l], axes_.mean[2][l]);
    out.center[v] = alone ? mesh_.position(rank) : Vec3(mesh_.position(sources_[0]) + mean);
    out.axis[v] = Vec3::Zero();
    out.winding_angle_rad[v] = out.accumulated_angle_rad[v] = std::nan("");
    Vec3 axis(axes_.axis[0][l], axes_.axis[1][l], axes_.axis[2][l]);
    if (alone || axes_.state[l] == LaneAxes::none) return;
    if (axes_.state[l] == LaneAxes::unsure && !solve_axis(sum, mean, axis)) return;
    axis = directed(axis);
    out.axis[v] = axis;
    if (!job_->options.winding) return;
    const LaneBall ball{region_.slot(), masks_[q].data() + l / 64, std::uint64_t{1} << (l % 64)};
    tasks_.push_back({ball, rank, out.center[v], axis, 0, 0});
  }

  /// The slow, safe way; false where no axis is dominant.
  bool solve_axis(const double* sum, const Vec3& mean, Vec3& axis) const {
    Eigen::Matrix3d scatter;
    scatter << sum[slot_xx], sum[slot_xy], sum[slot_xz],  //
        sum[slot_xy], sum[slot_yy], sum[slot_yz],         //
        sum[slot_xz], sum[slot_yz], sum[slot_zz];
    scatter -= sum[slot_count] * mean * mean.transpose();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(scatter);
    const Vec3& values = solver.eigenvalues();
    axis = solver.eigenvectors().col(2);
    return values[2] > 0 && values[2] >= job_->options.eigenvalue_ratio_guard * values[1];
  }

  void measure_sections(BallFields& out) {
    walker_.measure(tasks_);
    for (const CutTask& task : tasks_) {
      const int v = mesh_.original[task.source];
      out.winding_angle_rad[v] = task.winding_rad;
      out.accumulated_angle_rad[v] = task.accumulated_rad;
    }
  }

  Job* job_ = nullptr;
  const BallMesh& mesh_;
  Region region_;
  LengthSearch exact_;
  SectionWalker walker_;
  const int* sources_ = nullptr;
  int count_ = 0;
  Aligned<std::uint8_t> rows_;
  std::vector<std::uint8_t> dirty_;
  std::vector<Aligned<std::uint64_t>> masks_;
  Aligned<double> sums_;
  LaneAxes axes_;
  std::vector<MaskRange> ranges_;
  std::vector<int>
      ring_;  ///< of the vertex that is looked at, with its last one before and its first one after
  std::vector<int> end_;                ///< of each radius: no vertex from there on is in any ball
  std::vector<std::uint32_t> reaches_;  ///< of each radius, from the patch
  std::vector<CutTask> tasks_;
  std::vector<std::array<std::uint64_t, mask_words>> undecided_;  ///< of each radius, the lanes
  std::uint64_t too_far_[mask_words] = {};
};

}  // namespace

struct LaneBalls::Kept {
  explicit Kept(const TriangleMesh& mesh) : ground(mesh) {}
  Ground ground;
  std::vector<std::unique_ptr<PatchBalls>> desks;  ///< one a thread
};

LaneBalls::LaneBalls(const TriangleMesh& mesh) : mesh_(mesh) {
  if (!mesh.vertices.empty()) kept_ = std::make_unique<Kept>(mesh);
}
LaneBalls::~LaneBalls() = default;

BallSet LaneBalls::fields(const std::vector<double>& radii_m, Metric metric, const BallOptions& options,
                          LaneReport* report) {
  BallSet set;
  for (double radius : radii_m) set.radii.push_back(BallFields::of_size(mesh_.vertices.size(), radius));
  if (!kept_) return set;
  Job job(kept_->ground.mesh, metric, options, set);
  kept_->ground.patches.rewind();
  kept_->desks.resize(std::max(kept_->desks.size(), static_cast<std::size_t>(omp_get_max_threads())));
  std::vector<int> too_far;
  int searched_whole = 0, searched_exactly = 0;
#pragma omp parallel
  {
    auto& desk = kept_->desks[static_cast<std::size_t>(omp_get_thread_num())];
    if (!desk) desk = std::make_unique<PatchBalls>(kept_->ground);
    desk->begin(job);
    for (auto patch = kept_->ground.patches.next(); !patch.empty(); patch = kept_->ground.patches.next())
      desk->run(patch);
#pragma omp critical
    {
      too_far.insert(too_far.end(), desk->too_far.begin(), desk->too_far.end());
      searched_exactly += desk->searched_exactly;
      searched_whole += desk->searched_whole();
    }
  }
  std::sort(too_far.begin(), too_far.end());
  too_far.erase(std::unique(too_far.begin(), too_far.end()), too_far.end());
  if (!too_far.empty()) PlainBalls(mesh_, metric, options).measure(too_far, set);
  if (report) *report = {searched_whole, searched_exactly + static_cast<int>(too_far.size())};
  return set;
}

BallSet lane_ball_fields(const TriangleMesh& mesh, const std::vector<double>& radii_m, Metric metric,
                         const BallOptions& options, LaneReport* report) {
  return LaneBalls(mesh).fields(radii_m, metric, options, report);
}

}  // namespace geocage::topology
