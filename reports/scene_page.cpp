#include "reports/scene_page.h"

#include <fmt/format.h>

#include "geometry/scene.h"
#include "reports/html.h"
#include "reports/scenes.h"

namespace geocage::reports {

namespace fs = std::filesystem;
using geometry::Scene;

namespace {

constexpr std::size_t most_shown = 60000;
constexpr double margin_m = 0.05;  ///< of what is shown round the objects

Colour colour_of(std::size_t object) {
  return oklch(0.68, 0.15, 25 + 137.5 * static_cast<double>(object));  // the golden angle: neighbours differ
}

Eigen::AlignedBox3d box_of(const Scene& scene) {
  Eigen::AlignedBox3d box;
  for (const auto& object : scene.objects)
    for (int i : object.points) box.extend(scene.cloud.points[i]);
  box.min().array() -= margin_m;
  box.max().array() += margin_m;
  return box;
}

View from_sensor(const Scene& scene, const geometry::Vec3& middle) {
  View view;
  if (scene.cloud.support) view.up = scene.cloud.support->normal;
  if (!scene.cloud.sensor_origins.empty()) {
    view.from = (scene.cloud.sensor_origins.front() - middle).normalized();
    if (!scene.cloud.support) view.up = -geometry::Vec3::UnitY();  // of a camera's own frame: y is down
  }
  return view;
}

/// The points near the objects as squares that face the reader, every so many of them.
Part points_of(const Scene& scene, const Eigen::AlignedBox3d& box, const View& view, bool objects_too) {
  std::vector<int> object_of(scene.cloud.size(), -1);
  for (std::size_t k = 0; k < scene.objects.size(); ++k)
    for (int i : scene.objects[k].points) object_of[i] = static_cast<int>(k);
  std::vector<geometry::Vec3> points;
  std::vector<Colour> colours;
  const std::size_t stride = scene.cloud.size() / most_shown + 1;
  for (std::size_t i = 0; i < scene.cloud.size(); i += object_of[i] >= 0 ? 1 : stride) {
    if (!box.contains(scene.cloud.points[i]) || (object_of[i] >= 0 && !objects_too)) continue;
    points.push_back(scene.cloud.points[i]);
    colours.push_back(object_of[i] < 0 ? oklch(0.62, 0, 0) : colour_of(object_of[i]));
  }
  constexpr double square_m = 0.002;
  return point_part(points, std::vector<geometry::Vec3>(points.size(), view.from), square_m, colours);
}

std::string figure(const fs::path& pictures, const std::string& file, const Studio& studio, const View& view,
                   const std::string& title, const std::string& caption) {
  write_png(pictures / file, studio.picture(view, {.ground = false}));
  return element("figure", fmt::format("<img src=\"pictures/{}\" alt=\"{}\" width=\"640\" "
                                       "height=\"480\"><figcaption><b>{}</b>{}</figcaption>",
                                       file, escaped(title), escaped(title), caption));
}

template <class T>
T loaded(const fs::path& folder) {
  T value;
  load_artefact(value, folder);
  return value;
}

}  // namespace

std::string scene_section(const SceneInput& input, const fs::path& pictures, const std::string& prefix) {
  const auto scene = loaded<Scene>(input.scene);
  const auto box = box_of(scene);
  const View view = from_sensor(scene, box.center());
  std::string figures, names;
  for (std::size_t k = 0; k < scene.objects.size(); ++k)
    names += element("span",
                     escaped(input.name + (scene.objects[k].name.empty() ? "" : ".") + scene.objects[k].name),
                     fmt::format("class=\"badge\" style=\"background:{};color:#111\"", css(colour_of(k)))) +
             " ";
  figures += figure(pictures, prefix + "-parts.png", Studio({points_of(scene, box, view, true)}), view,
                    "What was seen, a colour an object",
                    fmt::format("Objects: {}, points: {}; the table and all else grey.", scene.objects.size(),
                                scene.cloud.size()));
  std::vector<Part> parts = {points_of(scene, box, view, false)};
  if (parts[0].mesh.triangles.empty()) parts.clear();
  std::size_t closed = 0;
  for (std::size_t k = 0; k < input.meshes.size() && k < scene.objects.size(); ++k) {
    if (input.meshes[k].empty()) continue;
    auto mesh = loaded<TriangleMesh>(input.meshes[k]);
    const std::vector<Colour> colours(mesh.vertices.size(), colour_of(k));
    parts.push_back({std::move(mesh), colours, {}});
    ++closed;
  }
  if (closed > 0)
    figures +=
        figure(pictures, prefix + "-closed.png", Studio(std::move(parts)), view, "Their closed surfaces",
               fmt::format("{} of {}, from the same place.", closed, scene.objects.size()));
  return element("section", element("h2", escaped(input.name)) + element("p", names) +
                                element("div", figures, "class=\"figures\""));
}

}  // namespace geocage::reports
