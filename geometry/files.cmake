# Readers of foreign files and the artefacts that libraries write.
set(GEOMETRY_FILE_SOURCES clearance.cpp cloud.cpp cloud_files.cpp cloud_text.cpp decimate.cpp file_guards.cpp mesh_files.cpp occupancy.cpp scene.cpp)
set(GEOMETRY_FILE_USES assimp::assimp meshoptimizer::meshoptimizer octomap octomath pcl)
