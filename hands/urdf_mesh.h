#pragma once
#include <filesystem>

#include "geometry/mesh.h"
#include "hands/kinematics.h"

namespace geocage::hands {

/// The file of a mesh in the URDF `urdf`: a path, relative to the URDF's folder, `file://`, or
/// `package://NAME/...` (`model://` alike), sought in the folders that GEOCAGE_PACKAGE_PATH and
/// ROS_PACKAGE_PATH list (one may be the package itself) and then beside and above the URDF. UserError
/// (configuration) that names the link, the mesh and where it was sought when there is no such file.
std::filesystem::path find_mesh(const LinkMesh& mesh, const KinematicTree& tree,
                                const std::filesystem::path& urdf);

/// A mesh that read_urdf found, in the frame of its link: scale and origin applied, outside kept outside when
/// the scale mirrors.
geometry::TriangleMesh read_link_mesh(const LinkMesh& mesh);

}  // namespace geocage::hands
