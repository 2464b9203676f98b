// glTF files against the specification's own words (Khronos' validator and three.js read them in
// tests/viewer), and what packs them.
#include "reports/gltf.h"

#include <cmath>
#include <cstring>

#include <gtest/gtest.h>
#include <zlib.h>

#include "datasets/shapes.h"
#include "reports/packed.h"

namespace geocage::reports {
namespace {

using nlohmann::json;

template <class T>
T number_at(const std::vector<std::uint8_t>& bytes, std::size_t at) {
  T value;
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

/// The two chunks of a binary glTF (specification, section 4.4).
struct Parts {
  json head;
  std::vector<std::uint8_t> binary;
};
Parts parts_of(const std::vector<std::uint8_t>& glb) {
  EXPECT_EQ(std::string(glb.begin(), glb.begin() + 4), "glTF");
  EXPECT_EQ(number_at<std::uint32_t>(glb, 4), 2u);
  EXPECT_EQ(number_at<std::uint32_t>(glb, 8), glb.size());
  const auto length = number_at<std::uint32_t>(glb, 12);
  EXPECT_EQ(length % 4, 0u);
  EXPECT_EQ(std::string(glb.begin() + 16, glb.begin() + 20), "JSON");
  Parts parts{json::parse(glb.begin() + 20, glb.begin() + 20 + length), {}};
  const std::size_t next = 20 + length;
  if (next == glb.size()) return parts;
  EXPECT_EQ(std::string(glb.begin() + next + 4, glb.begin() + next + 7), "BIN");
  parts.binary.assign(glb.begin() + next + 8, glb.end());
  EXPECT_EQ(parts.binary.size(), number_at<std::uint32_t>(glb, next));
  EXPECT_EQ(parts.binary.size(), parts.head["buffers"][0]["byteLength"]);
  return parts;
}

TEST(Gltf, PositionsAndFieldsComeBackToHalfAStep) {
  const auto mesh = datasets::torus(0.05, 0.015, 24, 12);
  GltfField field{"winding_angle_rad", "S1", "rad", {}};
  for (const auto& p : mesh.vertices) field.values.push_back(p.x() > 0.06 ? std::nan("") : 10 * p.y());
  Gltf file;
  const int node = file.add_node("ring", -1, geometry::Pose::Identity());
  file.add_surface(node, mesh, {field}, {});
  const auto [head, binary] = parts_of(file.glb());
  const json& primitive = head["meshes"][0]["primitives"][0];
  const json& shape = head["nodes"][head["nodes"][node]["children"][0].get<int>()];
  const auto start = [&](const json& accessor) {
    return head["bufferViews"][accessor["bufferView"].get<int>()]["byteOffset"].get<std::size_t>();
  };
  const json& positions = head["accessors"][primitive["attributes"]["POSITION"].get<int>()];
  const json& codes = head["accessors"][primitive["attributes"]["_WINDING_ANGLE_RAD"].get<int>()];
  ASSERT_EQ(positions["count"], mesh.vertices.size());
  const json& told = primitive["extras"]["fields"][0];
  const double low = told["low"], high = told["high"], step = shape["scale"][0];
  EXPECT_NEAR(step, 0.13 / 65535, 1e-12) << "the ring is 130 mm wide";
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    for (int k = 0; k < 3; ++k)
      EXPECT_NEAR(shape["translation"][k].get<double>() +
                      step * number_at<std::uint16_t>(binary, start(positions) + 8 * v + 2 * k),
                  mesh.vertices[v][k], 0.5001 * step);
    const auto code = number_at<std::uint16_t>(binary, start(codes) + 4 * v);
    if (std::isnan(field.values[v]))
      EXPECT_EQ(code, 65535);
    else
      EXPECT_NEAR(low + (high - low) * code / 65534, field.values[v], 0.5001 * (high - low) / 65534);
  }
}

TEST(Gltf, ManyVerticesGetWideIndices) {
  for (const auto& [around, type] : {std::pair{250, 5123}, {260, 5125}}) {  // 62,500 and 65,000 and more
    Gltf file;
    file.add_surface(file.add_node("ring", -1, geometry::Pose::Identity()),
                     datasets::torus(1, 0.1, around, around), {}, {});
    const auto [head, binary] = parts_of(file.glb());
    EXPECT_EQ(head["accessors"][head["meshes"][0]["primitives"][0]["indices"].get<int>()]["componentType"],
              type);
  }
}

TEST(Gltf, AnimationsTurnTheShortWayRound) {
  Gltf file;
  const int node = file.add_node("hand", -1, geometry::Pose::Identity());
  std::vector<geometry::Pose> poses;
  for (int i = 0; i < 8; ++i) poses.emplace_back(Eigen::AngleAxisd(i, geometry::Vec3::UnitZ()));
  file.add_animation("turn", {0, 1, 2, 3, 4, 5, 6, 7}, {{node, poses}});
  const auto [head, binary] = parts_of(file.glb());
  const json& animation = head["animations"][0];
  EXPECT_EQ(animation["channels"].size(), 2u);
  const int output = animation["samplers"][animation["channels"][1]["sampler"].get<int>()]["output"];
  const std::size_t start =
      head["bufferViews"][head["accessors"][output]["bufferView"].get<int>()]["byteOffset"];
  for (int i = 0; i + 1 < 8; ++i) {
    double dot = 0;
    for (int k = 0; k < 4; ++k)
      dot += number_at<float>(binary, start + 16 * i + 4 * k) *
             number_at<float>(binary, start + 16 * (i + 1) + 4 * k);
    EXPECT_NEAR(dot, std::cos(0.5), 1e-6);
  }
}

TEST(Gltf, AnEmptySceneIsAFile) {
  EXPECT_EQ(parts_of(Gltf().glb()).head["asset"]["version"], "2.0");
}

TEST(Packed, Base64AsRfc4648Says) {
  const auto of = [](std::string_view text) {
    return base64(std::span(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
  };
  const std::pair<const char*, const char*> vectors[] = {{"", ""},
                                                         {"f", "Zg=="},
                                                         {"fo", "Zm8="},
                                                         {"foo", "Zm9v"},
                                                         {"foob", "Zm9vYg=="},
                                                         {"fooba", "Zm9vYmE="},
                                                         {"foobar", "Zm9vYmFy"}};
  for (const auto& [text, code] : vectors) EXPECT_EQ(of(text), code);
}

TEST(Packed, ZlibOpensIt) {
  std::string text;
  for (int i = 0; i < 1000; ++i) text += "\xff<\"" + std::to_string(i * i);
  const std::string code = packed(text);
  EXPECT_LT(code.size(), text.size());
  std::vector<std::uint8_t> bytes;
  std::uint32_t word = 0;
  int bits = 0;
  for (const char c : code) {
    if (c == '=') break;
    const char* digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    word = word << 6 | static_cast<std::uint32_t>(std::strchr(digits, c) - digits);
    if ((bits += 6) >= 8) bytes.push_back(static_cast<std::uint8_t>(word >> (bits -= 8)));
  }
  std::string back(text.size(), '\0');
  uLongf size = back.size();
  ASSERT_EQ(uncompress(reinterpret_cast<Bytef*>(back.data()), &size, bytes.data(), bytes.size()), Z_OK);
  EXPECT_EQ(back, text);
}

}  // namespace
}  // namespace geocage::reports
