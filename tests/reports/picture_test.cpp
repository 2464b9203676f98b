#include "reports/picture.h"

#include <cmath>
#include <filesystem>
#include <numbers>
#include <set>

#include <gtest/gtest.h>
#include <omp.h>
#include <png.h>

#include "datasets/shapes.h"
#include "reports/camera.h"
#include "reports/scenes.h"

namespace geocage::reports {
namespace {

const PictureStyle small{.width = 160, .height = 120, .ground = false};

Part painted(const TriangleMesh& mesh, const Colour& colour) {
  return {mesh, std::vector<Colour>(mesh.vertices.size(), colour), {}};
}
std::vector<Part> one(Part part) {
  std::vector<Part> parts;
  parts.push_back(std::move(part));
  return parts;
}

double opaque_pixels(const Image& image) {
  double sum = 0;
  for (std::size_t i = 3; i < image.rgba.size(); i += 4) sum += image.rgba[i] / 255.0;
  return sum;
}

// Seen by a pinhole a ball that just fits fills a circle as high as the picture, less the border of 6 %.
TEST(Picture, BallFillsACircle) {
  const Image image = Studio(one(painted(datasets::icosphere(0.05, 4), {1, 0, 0}))).picture({}, small);
  const double circle = std::numbers::pi / 4 * std::pow(120 / 1.06, 2);
  // The polyhedron's outline lies inside by up to 1 - cos(half an edge's angle), 0.1 %; edge pixels are known
  // to 1/4.
  EXPECT_NEAR(opaque_pixels(image), circle, 0.01 * circle);
}

TEST(Picture, ShowsItsColoursAndNothingElse) {
  const Image image = Studio(one(painted(datasets::icosphere(0.05, 3), {1, 0.1, 0.1}))).picture({}, small);
  for (std::size_t i = 0; i < image.rgba.size(); i += 4) {
    if (image.rgba[i + 3] == 255) {
      EXPECT_GT(image.rgba[i], image.rgba[i + 1]);
    }
  }
  EXPECT_EQ(image.rgba[3], 0) << "a corner is background";
}

TEST(Picture, FloorDarkensBelowTheObjectOnly) {
  const Studio studio(one(painted(datasets::icosphere(0.05, 3), Colour::Ones())));
  PictureStyle with_floor = small;
  with_floor.ground = true;
  const Image without = studio.picture({}, small), with = studio.picture({}, with_floor);
  EXPECT_GT(opaque_pixels(with), 1.05 * opaque_pixels(without));
  EXPECT_EQ(studio.grid_m(), 0.02);  // diagonal 17 cm, sixth of it 2.9 cm
}

TEST(Picture, SameBytesForAnyNumberOfThreads) {
  const Studio studio(one(painted(datasets::torus(0.05, 0.02, 48, 24), {0.2, 0.5, 0.9})));
  PictureStyle style = small;
  style.ground = true;
  const int threads = omp_get_max_threads();
  omp_set_num_threads(1);
  const Image alone = studio.picture({}, style);
  omp_set_num_threads(4);
  const Image together = studio.picture({}, style);
  omp_set_num_threads(threads);
  EXPECT_EQ(alone.rgba, together.rgba);
}

TEST(Picture, PngReadsBackTheSamePixels) {
  const Image image = Studio(one(painted(datasets::torus(0.05, 0.02, 48, 24), {0.2, 0.5, 0.9}))).picture({});
  const auto file = std::filesystem::path(testing::TempDir()) / "picture_test.png";
  write_png(file, image);
  png_image header{};
  header.version = PNG_IMAGE_VERSION;
  ASSERT_TRUE(png_image_begin_read_from_file(&header, file.c_str()));
  header.format = PNG_FORMAT_RGBA;
  std::vector<std::uint8_t> pixels(PNG_IMAGE_SIZE(header));
  ASSERT_TRUE(png_image_finish_read(&header, nullptr, pixels.data(), 0, nullptr));
  EXPECT_EQ(header.width, 640u);
  EXPECT_EQ(header.height, 480u);
  EXPECT_EQ(pixels, image.rgba);
  std::set<std::uint8_t> shades;
  for (std::size_t i = 2; i < pixels.size(); i += 4) shades.insert(pixels[i]);
  EXPECT_GT(shades.size(), 50u) << "shaded, not blank";
  std::filesystem::remove(file);
}

// A coarse cell is 8 wide, so rounding moves a channel by at most 4; the palette's nearest colour of rarer
// ones is at most some cells away, seldom more than one.
TEST(Picture, FewColoursStayNearTheirs) {
  const Image image =
      Studio(one(painted(datasets::torus(0.05, 0.02, 48, 24), {0.2, 0.5, 0.9}))).picture({}, small);
  const auto file = std::filesystem::path(testing::TempDir()) / "indexed_test.png";
  write_indexed_png(file, image);
  png_image header{};
  header.version = PNG_IMAGE_VERSION;
  ASSERT_TRUE(png_image_begin_read_from_file(&header, file.c_str()));
  header.format = PNG_FORMAT_RGBA;
  std::vector<std::uint8_t> pixels(PNG_IMAGE_SIZE(header));
  ASSERT_TRUE(png_image_finish_read(&header, nullptr, pixels.data(), 0, nullptr));
  ASSERT_EQ(pixels.size(), image.rgba.size());
  double sum = 0;
  int most = 0;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    if (image.rgba[i / 4 * 4 + 3] < 4) continue;  // of what can't be seen, colours don't matter
    const int off = std::abs(pixels[i] - image.rgba[i]);
    most = std::max(most, off);
    sum += off;
  }
  EXPECT_LE(most, 24);
  EXPECT_LT(sum / static_cast<double>(pixels.size()), 4);
  write_png(file.string() + ".full", image);
  EXPECT_LT(std::filesystem::file_size(file),
            0.5 * static_cast<double>(std::filesystem::file_size(file.string() + ".full")));
}

TEST(Camera, EveryPointIsInsideAndOneTouchesTheBorder) {
  const auto parts = one(painted(datasets::box({0.3, 0.1, 0.02}), Colour::Ones()));
  const View view{Vec3(1, 2, 3).normalized(), Vec3::UnitZ()};
  const Camera camera(view, 4.0 / 3, parts);
  const Ray center = camera.ray(0.5, 0.5), corner = camera.ray(1, 1);
  const double half_width =
      std::abs(corner.direction.dot(camera.right()) / corner.direction.dot(center.direction));
  const double half_height =
      std::abs(corner.direction.dot(camera.up()) / corner.direction.dot(center.direction));
  double most = 0;
  for (const Vec3& p : parts[0].mesh.vertices) {
    const Vec3 seen = p - center.origin;
    const double depth = seen.dot(center.direction);
    most = std::max({most, std::abs(seen.dot(camera.right())) / depth / half_width,
                     std::abs(seen.dot(camera.up())) / depth / half_height});
  }
  EXPECT_NEAR(most, 1 / 1.06, 1e-12);
}

TEST(Scenes, CapsuleIsClosedAndHasItsVolume) {
  const Part part = capsule_part({0.1, 0, 0}, {0.1, 0.05, 0.02}, 0.01, Colour::Ones());
  const double length = std::hypot(0.05, 0.02);
  const double volume = std::numbers::pi * 1e-4 * length + 4.0 / 3 * std::numbers::pi * 1e-6;
  double sum = 0;
  for (const auto& [a, b, c] : part.mesh.triangles)
    sum += part.mesh.vertices[a].dot(part.mesh.vertices[b].cross(part.mesh.vertices[c])) / 6;
  EXPECT_LT(sum, volume);
  EXPECT_GT(sum,
            0.98 * volume);  // 32 points around lose 1 - sin(2 pi/32) / (2 pi/32) = 0.6 %, 16 rings the like
}

TEST(Scenes, ClearestViewSeesWhatAWallHides) {
  std::vector<Part> parts;
  parts.push_back(painted(datasets::box({0.01, 0.2, 0.2}), Colour::Ones()));
  parts.push_back(ball_part({{0.05, 0, 0}}, 0.02, Colour::Ones()));
  const View view = clearest_view(Studio(std::move(parts)), Vec3::UnitZ());
  EXPECT_GT(view.from.x(), 0) << "the ball is on that side of the wall";
}

}  // namespace
}  // namespace geocage::reports
