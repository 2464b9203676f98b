find_package(OpenMP REQUIRED COMPONENTS CXX)
find_package(OpenSSL REQUIRED)
find_package(SQLite3 REQUIRED)
find_package(PNG REQUIRED)
find_package(ZLIB REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(CGAL 5.5 REQUIRED)
include(CGAL_Eigen3_support) # finds nothing before Eigen3
find_package(embree 3 REQUIRED)
find_package(assimp REQUIRED)
find_package(meshoptimizer REQUIRED)
find_package(octomap REQUIRED)
find_package(hwy REQUIRED)
find_package(CLI11 REQUIRED)
find_package(fmt REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(tomlplusplus REQUIRED)
find_package(urdfdom_headers REQUIRED)
find_package(urdfdom REQUIRED)

# PCL without its config file, which searches for VTK, Qt and MPI whatever one asks for. Only the include folder is
# ours to find; Debian's build is baseline x86-64, so no -march ever reaches these files.
find_path(PCL_INCLUDE pcl/point_types.h PATH_SUFFIXES pcl-1.13 REQUIRED)
add_library(pcl INTERFACE)
target_include_directories(pcl SYSTEM INTERFACE ${PCL_INCLUDE})
foreach(part surface registration features filters segmentation sample_consensus search octree kdtree io io_ply common)
  find_library(PCL_${part} pcl_${part} REQUIRED)
  target_link_libraries(pcl INTERFACE ${PCL_${part}})
endforeach()
target_link_libraries(pcl INTERFACE Eigen3::Eigen lz4 flann_cpp boost_filesystem boost_iostreams OpenMP::OpenMP_CXX)

# Bullet in double precision; CMake's own module finds the float build only.
find_path(BULLET_INCLUDE btBulletDynamicsCommon.h PATH_SUFFIXES bullet REQUIRED)
add_library(bullet INTERFACE)
target_include_directories(bullet SYSTEM INTERFACE ${BULLET_INCLUDE})
target_compile_definitions(bullet INTERFACE BT_USE_DOUBLE_PRECISION)
foreach(part BulletDynamics BulletCollision LinearMath)
  find_library(BULLET_${part} ${part}-float64 REQUIRED)
  target_link_libraries(bullet INTERFACE ${BULLET_${part}})
endforeach()

# Qhull, the reentrant C library; Debian ships no config file for it.
find_path(QHULL_INCLUDE libqhull_r/libqhull_r.h REQUIRED)
find_library(QHULL_LIBRARY qhull_r REQUIRED)
add_library(qhull INTERFACE)
target_include_directories(qhull SYSTEM INTERFACE ${QHULL_INCLUDE})
target_link_libraries(qhull INTERFACE ${QHULL_LIBRARY})

# OMPL by hand: its config file brings Boost's and Eigen's older names.
find_path(OMPL_INCLUDE ompl/base/SpaceInformation.h PATH_SUFFIXES ompl-1.5 REQUIRED)
find_library(OMPL_LIBRARY ompl REQUIRED)
add_library(ompl INTERFACE)
target_include_directories(ompl SYSTEM INTERFACE ${OMPL_INCLUDE})
target_link_libraries(ompl INTERFACE ${OMPL_LIBRARY} Eigen3::Eigen)
