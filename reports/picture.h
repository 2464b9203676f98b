#pragma once
#include <memory>
#include <vector>

#include "geometry/mesh.h"
#include "reports/colours.h"
#include "reports/image.h"

namespace geocage::reports {

using geometry::TriangleMesh;
using geometry::Vec3;

/// A surface of a picture, with a colour a vertex.
struct Part {
  TriangleMesh mesh;
  std::vector<Colour> colours;
  std::vector<Vec3> normals;  ///< a unit normal a vertex, or empty: those of the mesh
};

/// Where the camera stands; the distance follows from what shall be seen.
struct View {
  Vec3 from = Vec3(1, -1, 0.6).normalized();  ///< unit, from the scene to the camera
  Vec3 up = Vec3::UnitZ();
};

struct PictureStyle {
  int width = 640, height = 480;
  bool ground = true;  ///< a floor under everything, seen by its shadow and its grid alone
  int samples = 2;     ///< a side: samples^2 rays a pixel
};

/// Parts ready to be looked at. Embree finds what rays hit; lit by one large lamp and an even sky with
/// occlusion. Same bytes for any thread count. The background is transparent.
class Studio {
 public:
  /// Precondition: some triangle; indices valid; colours as many as vertices.
  explicit Studio(std::vector<Part> parts);
  ~Studio();

  Image picture(const View& view, const PictureStyle& style = {}) const;
  /// How many of the rays of a coarse grid see each part.
  std::vector<int> rays_on_parts(const View& view) const;
  /// The side of the floor's squares: the 1, 2 or 5 times a power of ten that suits the scene's size.
  double grid_m() const;

 private:
  struct Tracer;
  std::unique_ptr<Tracer> tracer_;
};

}  // namespace geocage::reports
