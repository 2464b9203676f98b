#include "tests/stages/import/locally_convex.h"

#include <map>

#include <pcl/segmentation/lccp_segmentation.h>
#include <pcl/segmentation/supervoxel_clustering.h>

#include "geometry/cloud_files.h"
#include "geometry/pcl_points.h"
#include "stages/import/import.h"
#include "stages/import/table.h"

namespace geocage::tests {

geometry::Scene locally_convex_objects(const std::filesystem::path& file, bool extended) {
  constexpr float voxel_m = 0.0075F, seed_m = 0.03F;
  const stages::ImportParams defaults;
  geometry::Scene scene;
  scene.cloud = geometry::read_cloud(file, 1);
  const auto table = stages::find_plane(scene.cloud, defaults.plane_tolerance_m, defaults.seed);
  const auto standing = stages::standing_on(scene.cloud, table, defaults.above_min_m, defaults.above_max_m);
  std::vector<geometry::Vec3> points;
  for (int i : standing) points.push_back(scene.cloud.points[i]);

  pcl::SupervoxelClustering<pcl::PointXYZ> supervoxels(voxel_m, seed_m);
  supervoxels.setUseSingleCameraTransform(false);
  supervoxels.setInputCloud(geometry::pcl_points(points, scene.cloud.sensor_origins.front()));
  supervoxels.setColorImportance(0);
  supervoxels.setSpatialImportance(1);
  supervoxels.setNormalImportance(4);
  std::map<std::uint32_t, pcl::Supervoxel<pcl::PointXYZ>::Ptr> found;
  supervoxels.extract(found);
  std::multimap<std::uint32_t, std::uint32_t> neighbours;
  supervoxels.getSupervoxelAdjacency(neighbours);

  pcl::LCCPSegmentation<pcl::PointXYZ> lccp;
  lccp.setConcavityToleranceThreshold(10);
  lccp.setSmoothnessCheck(true, voxel_m, seed_m, 0.1F);
  lccp.setSanityCheck(extended);
  lccp.setKFactor(extended ? 1 : 0);
  lccp.setMinSegmentSize(0);
  lccp.setInputSupervoxels(found, neighbours);
  lccp.segment();
  auto labelled = *supervoxels.getLabeledCloud();
  lccp.relabelCloud(labelled);

  std::map<std::uint32_t, std::vector<int>> groups;  // 0: in no supervoxel
  for (std::size_t i = 0; i < labelled.size(); ++i)
    if (labelled[i].label != 0) groups[labelled[i].label].push_back(standing[i]);
  for (auto& [label, group] : groups)
    if (static_cast<int>(group.size()) >= defaults.cluster_points)
      scene.objects.push_back({"", std::move(group)});
  return scene;
}

}  // namespace geocage::tests
