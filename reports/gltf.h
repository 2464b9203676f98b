#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "geometry/mesh.h"
#include "geometry/pose.h"
#include "reports/colours.h"

namespace geocage::reports {

/// A number a vertex, and what a reader needs to show it. `name` is that of the artefact's column.
struct GltfField {
  std::string name, title, unit;
  std::vector<double> values;  ///< NaN where there is none
};

/// Writes glTF 2.0 (Khronos 2021) as one binary file. Metres, right-handed; nodes keep the axes of their own
/// frames, so that a scene of O has O's axes and viewers that take y for up show z lying down. Positions are
/// whole numbers of 16 bits (KHR_mesh_quantization): off by at most 1/131070 of the mesh's longest side.
/// A field is an attribute `_NAME` of 16 bits from `low` to `high` of the primitive's `extras.fields`; 65535
/// is NaN. Same bytes for the same calls.
class Gltf {
 public:
  /// Answers its index; `parent` -1: a root of the scene. `extras` (an object or null) is the reader's
  /// `userData`.
  int add_node(const std::string& name, int parent, const geometry::Pose& X_PN, nlohmann::json extras = {});

  /// A surface below `node`. `colours` (linear light) may be empty: then it has the one `colour`.
  void add_surface(int node, const geometry::TriangleMesh& mesh, const std::vector<GltfField>& fields,
                   const std::vector<Colour>& colours, const Colour& colour = Colour::Constant(0.6));
  /// Points below `node`, in one colour.
  void add_points(int node, const std::vector<geometry::Vec3>& points, const Colour& colour);

  /// How a node's pose changes: key times in seconds, ascending, and a pose X_PN for each.
  struct Motion {
    int node;
    std::vector<geometry::Pose> X_PN;
  };
  void add_animation(const std::string& name, const std::vector<double>& times_s,
                     const std::vector<Motion>& motions);

  std::vector<std::uint8_t> glb() const;

 private:
  int add_view(std::size_t start, int stride, int target);
  int add_accessor(nlohmann::json accessor);
  int add_positions(const std::vector<geometry::Vec3>& points, int node, int& child);
  int add_floats(const std::vector<float>& values, int width, bool with_range);
  int add_field(const GltfField& field, nlohmann::json& told);
  int add_material(const Colour& colour, bool by_vertex);
  void add_primitive(int node, nlohmann::json primitive, nlohmann::json extras);
  template <class T>
  void put(T value);
  void align();

  nlohmann::json nodes_ = nlohmann::json::array(), meshes_ = nlohmann::json::array(),
                 accessors_ = nlohmann::json::array(), views_ = nlohmann::json::array(),
                 materials_ = nlohmann::json::array(), animations_ = nlohmann::json::array(),
                 roots_ = nlohmann::json::array();
  std::vector<std::uint8_t> bytes_;
};

}  // namespace geocage::reports
