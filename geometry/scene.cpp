#include "geometry/scene.h"

#include <cerrno>
#include <fstream>
#include <system_error>

#include <nlohmann/json.hpp>

#include "pipeline/text_file.h"

namespace geocage::geometry {

namespace fs = std::filesystem;
using nlohmann::json;

namespace {
template <class Stream>
void expect(const Stream& stream, const fs::path& file) {
  if (!stream) throw std::system_error(errno ? errno : EIO, std::generic_category(), file.string());
}
}  // namespace

std::string_view artefact_kind(const Scene*) {
  return "scene";
}

void save_artefact(const Scene& scene, const fs::path& dir) {
  save_artefact(scene.cloud, dir);
  json objects = json::array();
  std::ofstream points(dir / "points.bin", std::ios::binary);
  for (const auto& object : scene.objects) {
    objects.push_back({{"name", object.name}, {"points", object.points.size()}});
    points.write(reinterpret_cast<const char*>(object.points.data()),
                 static_cast<std::streamsize>(object.points.size() * sizeof(int)));
  }
  expect(points.flush(), dir / "points.bin");
  pipeline::write_text(dir / "scene.json",
                       json{{"schema", "geocage-scene 1"}, {"objects", objects}}.dump(1) + "\n");
}

void load_artefact(Scene& scene, const fs::path& dir) {
  scene = {};
  load_artefact(scene.cloud, dir);
  std::ifstream meta(dir / "scene.json"), points(dir / "points.bin", std::ios::binary);
  expect(meta, dir / "scene.json");
  const json read = json::parse(meta);
  for (const auto& entry : read["objects"]) {
    auto& object = scene.objects.emplace_back();
    object.name = entry["name"];
    object.points.resize(entry["points"]);
    points.read(reinterpret_cast<char*>(object.points.data()),
                static_cast<std::streamsize>(object.points.size() * sizeof(int)));
    expect(points, dir / "points.bin");
  }
}

}  // namespace geocage::geometry
