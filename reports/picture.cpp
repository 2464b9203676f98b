#include "reports/picture.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include <embree3/rtcore.h>

#include "reports/camera.h"

namespace geocage::reports {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// The i-th of evenly spread points in the unit square: the R2 sequence (Roberts 2018).
Eigen::Vector2d spread(int i) {
  const double x = 0.5 + 0.7548776662466927 * i, y = 0.5 + 0.5698402909980532 * i;
  return {x - std::floor(x), y - std::floor(y)};
}

/// Place of a tile's cell (x, y), both below 8, in an order whose every beginning is spread over the tile
/// (Bayer 1973).
int ordered(int x, int y) {
  int place = 0;
  for (int bit = 0; bit < 3; ++bit) place = 4 * place + 2 * (((x ^ y) >> bit) & 1) + ((y >> bit) & 1);
  return place;
}

/// A direction around n, denser towards n as its cosine.
Vec3 around_normal(const Vec3& n, const Eigen::Vector2d& u) {
  const double angle = 2 * std::numbers::pi * u.x(), r = std::sqrt(u.y());
  const Vec3 t = n.unitOrthogonal(), b = n.cross(t);
  return r * std::cos(angle) * t + r * std::sin(angle) * b + std::sqrt(1 - u.y()) * n;
}

struct Hit {
  double distance = 0;
  int part = 0;
  Vec3 p, normal;
  Colour colour;
};

}  // namespace

/// The parts in Embree, and what a ray finds there.
struct Studio::Tracer {
  explicit Tracer(std::vector<Part> given) : parts(std::move(given)) {
    device = rtcNewDevice("threads=1");
    scene = rtcNewScene(device);
    for (Part& part : parts) {
      if (part.normals.empty()) part.normals = geometry::vertex_normals(part.mesh);
      attach(part.mesh);
      for (const Vec3& p : part.mesh.vertices) box.extend(p);
    }
    rtcCommitScene(scene);
    reach = box.diagonal().norm();
  }
  ~Tracer() {
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }
  Tracer(const Tracer&) = delete;
  Tracer& operator=(const Tracer&) = delete;

  void attach(const TriangleMesh& mesh) {
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), mesh.vertices.size()));
    for (const Vec3& p : mesh.vertices)
      for (int axis = 0; axis < 3; ++axis) *vertices++ = static_cast<float>(p[axis]);
    auto* triangles = static_cast<unsigned*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned), mesh.triangles.size()));
    for (const auto& triangle : mesh.triangles)
      for (int corner : triangle) *triangles++ = static_cast<unsigned>(corner);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);  // ids count up from 0, as parts do
    rtcReleaseGeometry(geometry);
  }

  RTCRay embree_ray(const Ray& ray, double far) const {
    RTCRay r{};
    r.org_x = static_cast<float>(ray.origin.x()), r.dir_x = static_cast<float>(ray.direction.x());
    r.org_y = static_cast<float>(ray.origin.y()), r.dir_y = static_cast<float>(ray.direction.y());
    r.org_z = static_cast<float>(ray.origin.z()), r.dir_z = static_cast<float>(ray.direction.z());
    r.tfar = static_cast<float>(far);
    r.mask = ~0u;
    return r;
  }

  std::optional<Hit> first_hit(const Ray& ray) const {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    RTCRayHit query{embree_ray(ray, infinity), {}};
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(scene, &context, &query);
    if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return {};

    const Part& part = parts[query.hit.geomID];
    const auto& [a, b, c] = part.mesh.triangles[query.hit.primID];
    const double v = query.hit.u, w = query.hit.v, u = 1 - v - w;
    Hit hit;
    hit.distance = query.ray.tfar;
    hit.part = static_cast<int>(query.hit.geomID);
    hit.p = ray.origin + hit.distance * ray.direction;
    hit.colour = u * part.colours[a] + v * part.colours[b] + w * part.colours[c];
    const Vec3 &A = part.mesh.vertices[a], &B = part.mesh.vertices[b], &C = part.mesh.vertices[c];
    const Vec3 flat = (B - A).cross(C - A).normalized();
    hit.normal = (u * part.normals[a] + v * part.normals[b] + w * part.normals[c]).normalized();
    if (hit.normal.dot(flat) < 0.8) hit.normal = flat;  // a crease stays sharp
    if (hit.normal.dot(ray.direction) > 0) hit.normal = -hit.normal;
    return hit;
  }

  bool blocked(const Vec3& p, const Vec3& n, const Vec3& direction, double far) const {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    RTCRay ray = embree_ray({p + 1e-4 * reach * n, direction}, far);
    rtcOccluded1(scene, &context, &ray);
    return ray.tfar < 0;
  }

  RTCDevice device;
  RTCScene scene;
  std::vector<Part> parts;
  Eigen::AlignedBox3d box;
  double reach = 0;  ///< diagonal of everything
};

namespace {

/// Floor under everything: invisible but for shadows and lines.
struct Floor {
  Vec3 up, across, along, center;
  double height_m, square_m, radius_m;

  bool on_line(const Vec3& p) const {
    const auto near_line = [&](double x) {
      return std::abs(x / square_m - std::round(x / square_m)) < 0.012;
    };
    return near_line(p.dot(across)) || near_line(p.dot(along));
  }
};

/// What the camera sees through one point of the picture, and the light that arrives there.
struct Sample {
  enum class Kind { nothing, surface, floor } kind = Kind::nothing;
  Eigen::Vector3f p = Eigen::Vector3f::Zero(), normal = p, colour = p;
  bool lit = false;
  float lamp = 0, sky = 0;  ///< shares that arrive; the lamp's has the cosine of its angle in it
};

/// Light that leaves for the camera, premultiplied by how much of the background it hides.
struct Light {
  Colour colour = Colour::Zero();
  double alpha = 0;
};

/// One picture under way: a grid of samples, traced, lit, smoothed and developed. Every other sample of a
/// tile asks one direction of lamp and sky, each another; the mean over a tile's worth of neighbours on the
/// same surface has asked all of them, so that few rays give smooth shades without grain.
template <class Tracer>
class Exposure {
 public:
  Exposure(const Tracer& tracer, const Camera& camera, const Vec3& up, std::optional<Floor> floor,
           const PictureStyle& style)
      : tracer_(tracer),
        camera_(camera),
        up_(up),
        floor_(std::move(floor)),
        style_(style),
        width_(style.width * style.samples),
        height_(style.height * style.samples),
        samples_(static_cast<std::size_t>(width_) * height_) {
    lamp_ = (0.55 * camera.from() + 0.75 * up + 0.45 * camera.up() - 0.5 * camera.right()).normalized();
  }

  Image image() {
#pragma omp parallel for schedule(dynamic, 8)
    for (int y = 0; y < height_; ++y)
      for (int x = 0; x < width_; ++x) samples_[y * width_ + x] = sample(x, y);

    Image image{style_.width, style_.height, std::vector<std::uint8_t>(4ul * style_.width * style_.height)};
#pragma omp parallel for schedule(dynamic, 8)
    for (int row = 0; row < style_.height; ++row)
      for (int column = 0; column < style_.width; ++column)
        develop(pixel(column, row), image.rgba.data() + 4l * (row * style_.width + column));
    return image;
  }

 private:
  static constexpr int tile = 8;

  Ray ray(int x, int y) const {
    return camera_.ray((x + 0.5) / width_, (y + 0.5) / height_);
  }

  Sample sample(int x, int y) const {
    const Ray seen = ray(x, y);
    Sample sample;
    if (const auto hit = tracer_.first_hit(seen)) {
      sample = {Sample::Kind::surface, hit->p.template cast<float>(), hit->normal.template cast<float>(),
                hit->colour.template cast<float>()};
    } else if (floor_) {
      const double t = (floor_->height_m - seen.origin.dot(floor_->up)) / seen.direction.dot(floor_->up);
      const Vec3 p = seen.origin + t * seen.direction;
      if (!(t > 0) || (p - floor_->center).norm() > floor_->radius_m) return {};
      sample = {Sample::Kind::floor, p.cast<float>(), floor_->up.cast<float>(), Eigen::Vector3f::Zero()};
    }
    if (sample.kind != Sample::Kind::nothing && (x + y) % 2 == 0) light_up(sample, x, y);
    return sample;
  }

  /// Asks one direction of the lamp and one of the sky.
  void light_up(Sample& sample, int x, int y) const {
    const Vec3 p = sample.p.cast<double>(), n = sample.normal.cast<double>();
    const Eigen::Vector2d u = spread(ordered(x % tile, y % tile)),
                          jitter = u - Eigen::Vector2d::Constant(0.5);
    const Vec3 side = lamp_.unitOrthogonal();
    const Vec3 to_lamp = (lamp_ + 0.45 * (jitter.x() * side + jitter.y() * lamp_.cross(side))).normalized();
    const double facing = std::max(0.0, n.dot(to_lamp));
    const bool dark = facing == 0 || tracer_.blocked(p, n, to_lamp, 4 * tracer_.reach);
    const bool roofed = tracer_.blocked(p, n, around_normal(n, u), 0.35 * tracer_.reach);
    sample.lit = true;
    sample.lamp = dark ? 0 : static_cast<float>(facing);
    sample.sky = roofed ? 0 : 1;
  }

  bool on_one_piece(const Sample& a, const Sample& b) const {
    return a.kind == b.kind && a.normal.dot(b.normal) > 0.9f &&
           std::abs((a.p - b.p).dot(b.normal)) < 0.004f * tracer_.reach;
  }

  /// The sample with the mean light of the tile around it, as far as that lies on the same smooth piece of
  /// surface.
  Sample smoothed(int x, int y) const {
    Sample sample = samples_[y * width_ + x];
    float lamp = 0, sky = 0;
    int count = 0;
    for (int v = std::max(0, y - tile / 2); v < std::min(height_, y + tile / 2); ++v)
      for (int u = std::max(0, x - tile / 2); u < std::min(width_, x + tile / 2); ++u)
        if (const Sample& other = samples_[v * width_ + u]; other.lit && on_one_piece(other, sample)) {
          lamp += other.lamp;
          sky += other.sky;
          ++count;
        }
    if (count == 0) {  // a speck
      light_up(sample, x, y);
    } else {
      sample.lamp = lamp / static_cast<float>(count);
      sample.sky = sky / static_cast<float>(count);
    }
    return sample;
  }

  Light surface_light(const Sample& s, const Vec3& direction) const {
    const Vec3 n = s.normal.cast<double>();
    const double ambient = (0.46 + 0.12 * n.dot(up_)) * (0.2 + 0.8 * s.sky);
    const Vec3 half = (lamp_ - direction).normalized();
    const double gloss = 0.10 * std::min(1.0, 3.0 * s.lamp) * std::pow(std::max(0.0, n.dot(half)), 40);
    const double rim = 0.08 * s.sky * std::pow(1 + n.dot(direction), 3);
    return {s.colour.cast<double>() * (ambient + 0.5 * s.lamp) + Colour::Constant(gloss + rim), 1};
  }

  Light floor_light(const Sample& s) const {
    const Vec3 p = s.p.cast<double>();
    const double off = (p - floor_->center).norm() / floor_->radius_m, fade = std::pow(1 - off * off, 2);
    const double shadow = 0.28 * (1 - s.lamp / lamp_.dot(up_)) + 0.5 * (1 - s.sky);
    const double hidden = std::clamp(shadow, 0.0, 0.75) * fade;
    if (!floor_->on_line(p)) return {Colour::Zero(), hidden};
    const double line = 0.45 * fade;
    return {Colour::Constant(0.2) * line, line + hidden * (1 - line)};
  }

  Light pixel(int column, int row) const {
    Light mean;
    Sample lit;  // light changes slowly: the samples of a pixel share it while they see one surface
    const double share = 1.0 / (style_.samples * style_.samples);
    for (int y = row * style_.samples; y < (row + 1) * style_.samples; ++y)
      for (int x = column * style_.samples; x < (column + 1) * style_.samples; ++x) {
        Sample s = samples_[y * width_ + x];
        if (s.kind == Sample::Kind::nothing) continue;
        if (!on_one_piece(s, lit)) lit = smoothed(x, y);
        s.lamp = lit.lamp;
        s.sky = lit.sky;
        const Light light =
            s.kind == Sample::Kind::surface ? surface_light(s, ray(x, y).direction) : floor_light(s);
        mean.colour += share * light.colour.cwiseMin(light.alpha);
        mean.alpha += share * light.alpha;
      }
    return mean;
  }

  static void develop(const Light& light, std::uint8_t* rgba) {
    const auto byte = [](double x) {
      return static_cast<std::uint8_t>(std::lround(255 * std::clamp(x, 0.0, 1.0)));
    };
    for (int channel = 0; channel < 3; ++channel)
      rgba[channel] = light.alpha > 0 ? byte(srgb(light.colour[channel] / light.alpha)) : 0;
    rgba[3] = byte(light.alpha);
  }

  const Tracer& tracer_;
  const Camera& camera_;
  const Vec3 up_;
  const std::optional<Floor> floor_;
  const PictureStyle& style_;
  const int width_, height_;
  std::vector<Sample> samples_;
  Vec3 lamp_;
};

}  // namespace

Studio::Studio(std::vector<Part> parts) : tracer_(std::make_unique<Tracer>(std::move(parts))) {}
Studio::~Studio() = default;

double Studio::grid_m() const {
  const double rough = tracer_->reach / 6, decade = std::pow(10, std::floor(std::log10(rough)));
  return decade * (rough < 2 * decade ? 1 : rough < 5 * decade ? 2 : 5);
}

Image Studio::picture(const View& view, const PictureStyle& style) const {
  const Vec3 up = view.up.normalized();
  const Camera camera(view, static_cast<double>(style.width) / style.height, tracer_->parts);
  std::optional<Floor> floor;
  if (style.ground) {
    double height = infinity;
    for (const Part& part : tracer_->parts)
      for (const Vec3& p : part.mesh.vertices) height = std::min(height, p.dot(up));
    const Vec3 center = tracer_->box.center(), across = up.unitOrthogonal();
    floor = Floor{up,     across,   up.cross(across),     center + (height - center.dot(up)) * up,
                  height, grid_m(), 0.75 * tracer_->reach};
  }
  return Exposure(*tracer_, camera, up, std::move(floor), style).image();
}

std::vector<int> Studio::rays_on_parts(const View& view) const {
  constexpr int width = 64, height = 48;
  const Camera camera(view, static_cast<double>(width) / height, tracer_->parts);
  std::vector<int> rays(tracer_->parts.size());
  for (int row = 0; row < height; ++row)
    for (int column = 0; column < width; ++column)
      if (const auto hit = tracer_->first_hit(camera.ray((column + 0.5) / width, (row + 0.5) / height)))
        ++rays[hit->part];
  return rays;
}

}  // namespace geocage::reports
