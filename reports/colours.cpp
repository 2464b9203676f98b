#include "reports/colours.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

namespace geocage::reports {

namespace {

Colour from_oklab(double lightness, double a, double b) {
  const double l = std::pow(lightness + 0.3963377774 * a + 0.2158037573 * b, 3);
  const double m = std::pow(lightness - 0.1055613458 * a - 0.0638541728 * b, 3);
  const double s = std::pow(lightness - 0.0894841775 * a - 1.2914855480 * b, 3);
  return {4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s,
          -1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s,
          -0.0041960863 * l - 0.7034186147 * m + 1.7076147010 * s};
}

Colour sequential(double t) {
  return oklch(0.27 + 0.65 * t, 0.09 + 0.10 * t, 300 - 195 * t);
}

Colour diverging(double t) {
  const double side = 2 * t - 1;  // -1 blue .. 1 red
  return oklch(0.94 - 0.46 * std::abs(side), 0.19 * std::abs(side), side < 0 ? 255 : 28);
}

void drop_nan(std::vector<double>& values) {
  std::erase_if(values, [](double x) { return std::isnan(x); });
  std::sort(values.begin(), values.end());
}

/// Of sorted values, by nearest rank.
double quantile(const std::vector<double>& sorted, double share) {
  return sorted[static_cast<std::size_t>(std::lround(share * static_cast<double>(sorted.size() - 1)))];
}

}  // namespace

Colour oklch(double lightness, double chroma, double hue_deg) {
  const double hue = hue_deg * std::numbers::pi / 180;
  const auto colour = [&](double c) { return from_oklab(lightness, c * std::cos(hue), c * std::sin(hue)); };
  const auto exists = [](const Colour& c) { return c.minCoeff() >= 0 && c.maxCoeff() <= 1; };
  if (exists(colour(chroma))) return colour(chroma);
  double inside = 0, outside = chroma;
  for (int i = 0; i < 20; ++i) {
    const double middle = (inside + outside) / 2;
    (exists(colour(middle)) ? inside : outside) = middle;
  }
  return colour(inside).cwiseMax(0).cwiseMin(1);
}

Colour Scale::at(double value) const {
  if (std::isnan(value)) return Colour::Constant(0.36);
  const double t = high > low ? std::clamp((value - low) / (high - low), 0.0, 1.0) : 0.5;
  return map == Map::sequential ? sequential(t) : diverging(t);
}

Scale sequential_scale(std::vector<double> values, double outliers) {
  drop_nan(values);
  if (values.empty()) return {};
  return {Scale::Map::sequential, quantile(values, outliers / 2), quantile(values, 1 - outliers / 2)};
}

Scale diverging_scale(std::vector<double> values, double middle, double outliers) {
  for (double& x : values) x = std::abs(x - middle);
  drop_nan(values);
  const double reach = values.empty() ? 1 : quantile(values, 1 - outliers);
  return {Scale::Map::diverging, middle - reach, middle + reach};
}

double srgb(double linear) {
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
}

std::string css(const Colour& colour) {
  const auto byte = [](double x) { return std::lround(255 * srgb(std::clamp(x, 0.0, 1.0))); };
  return fmt::format("#{:02x}{:02x}{:02x}", byte(colour[0]), byte(colour[1]), byte(colour[2]));
}

}  // namespace geocage::reports
