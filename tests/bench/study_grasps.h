#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "physics/posture.h"

#include "geometry/distance_field.h"
#include "hands/grasp.h"

namespace geocage::bench {

/// An object and grasps of it that were made on a noisy copy of its surface, as those of a scan are.
struct StudyObject {
  std::string name;
  geometry::TriangleMesh mesh;  ///< the true one
  geometry::SignedDistanceField field;
  hands::GraspSet grasps;
};

struct StudyOptions {
  std::string folder, hand = "schunk_sdh";
  double noise_m = 0.002;
  int seeds = 2, grasps = 5;      ///< noisy copies of each object; grasps of each copy
  std::vector<std::string> only;  ///< names of objects; empty: all
};

/// The option `key` of a study, with its value; false when it is none of the above.
bool read_study_option(StudyOptions& options, const std::string& key, const std::string& value);

/// Every object of the folder: remeshed at 5 mm, its vertices moved along their normals by Gaussian noise,
/// scored and placed with the stages' defaults. Objects without a grasp are named on stderr and left out.
std::vector<StudyObject> study_grasps(const StudyOptions& options, const hands::Hand& hand);

}  // namespace geocage::bench
