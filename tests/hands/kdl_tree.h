#pragma once
#include <fstream>
#include <sstream>

#include <kdl/tree.hpp>
#include <urdf_parser/urdf_parser.h>

namespace geocage::tests {

/// The tree of a URDF as orocos-kdl has it, made from urdfdom's model without geocage's own reader.
struct KdlTree {
  urdf::ModelInterfaceSharedPtr model;
  KDL::Tree tree;

  explicit KdlTree(const std::string& file) {
    std::ostringstream text;
    text << std::ifstream(file).rdbuf();
    model = urdf::parseURDF(text.str());
    tree = KDL::Tree(model->getRoot()->name);
    add_children(*model->getRoot());
  }

  unsigned index(const std::string& link) const { return tree.getSegment(link)->second.q_nr; }

 private:
  static KDL::Segment segment(const urdf::Joint& joint) {
    const auto& p = joint.parent_to_joint_origin_transform.position;
    const auto& r = joint.parent_to_joint_origin_transform.rotation;
    const KDL::Frame frame(KDL::Rotation::Quaternion(r.x, r.y, r.z, r.w), KDL::Vector(p.x, p.y, p.z));
    const KDL::Vector axis = frame.M * KDL::Vector(joint.axis.x, joint.axis.y, joint.axis.z);
    auto type = KDL::Joint::RotAxis;
    if (joint.type == urdf::Joint::PRISMATIC) type = KDL::Joint::TransAxis;
    const KDL::Joint moved = joint.type == urdf::Joint::FIXED ? KDL::Joint(joint.name, KDL::Joint::Fixed)
                                                              : KDL::Joint(joint.name, frame.p, axis, type);
    return KDL::Segment(joint.child_link_name, moved, frame);
  }

  void add_children(const urdf::Link& link) {
    for (const auto& joint : link.child_joints) {
      tree.addSegment(segment(*joint), link.name);
      add_children(*model->getLink(joint->child_link_name));
    }
  }
};

}  // namespace geocage::tests
