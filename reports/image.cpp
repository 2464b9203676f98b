#include "reports/image.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <limits>
#include <map>
#include <system_error>

#include <png.h>

namespace geocage::reports {

void write_png(const std::filesystem::path& file, const Image& image) {
  png_image header{};
  header.version = PNG_IMAGE_VERSION;
  header.width = static_cast<png_uint_32>(image.width);
  header.height = static_cast<png_uint_32>(image.height);
  header.format = PNG_FORMAT_RGBA;
  if (!png_image_write_to_file(&header, file.c_str(), 0, image.rgba.data(), 0, nullptr))
    throw std::system_error(errno ? errno : EIO, std::generic_category(),
                            file.string() + ": " + header.message);
}

namespace {

using Rgba = std::array<std::uint8_t, 4>;

/// The middle of the colour's cell of 8 x 8 x 8 x 8.
Rgba coarse(const std::uint8_t* pixel) {
  Rgba colour;
  for (int k = 0; k < 4; ++k) colour[k] = static_cast<std::uint8_t>(std::min(255, (pixel[k] + 4) / 8 * 8));
  return colour[3] == 0 ? Rgba{} : colour;
}

int distance(const Rgba& a, const Rgba& b) {
  int sum = 0;
  for (int k = 0; k < 4; ++k) sum += (a[k] - b[k]) * (a[k] - b[k]);
  return sum;
}

}  // namespace

void write_indexed_png(const std::filesystem::path& file, const Image& image) {
  std::map<Rgba, int> counts;
  for (std::size_t i = 0; i < image.rgba.size(); i += 4) ++counts[coarse(&image.rgba[i])];
  std::vector<std::pair<int, Rgba>> order;
  order.reserve(counts.size());
  for (const auto& [colour, count] : counts) order.emplace_back(-count, colour);
  std::ranges::sort(order);
  std::vector<Rgba> palette;
  for (std::size_t i = 0; i < order.size() && i < 256; ++i) palette.push_back(order[i].second);
  std::map<Rgba, std::uint8_t> place;
  for (const auto& [colour, count] : counts) {
    int least = std::numeric_limits<int>::max();
    for (std::size_t i = 0; i < palette.size(); ++i)
      if (const int apart = distance(colour, palette[i]); apart < least)
        least = apart, place[colour] = static_cast<std::uint8_t>(i);
  }
  std::vector<std::uint8_t> indices;
  for (std::size_t i = 0; i < image.rgba.size(); i += 4) indices.push_back(place[coarse(&image.rgba[i])]);
  png_image header{};
  header.version = PNG_IMAGE_VERSION;
  header.width = static_cast<png_uint_32>(image.width);
  header.height = static_cast<png_uint_32>(image.height);
  header.format = PNG_FORMAT_RGBA_COLORMAP;
  header.colormap_entries = static_cast<png_uint_32>(palette.size());
  if (!png_image_write_to_file(&header, file.c_str(), 0, indices.data(), 0, palette.data()))
    throw std::system_error(errno ? errno : EIO, std::generic_category(),
                            file.string() + ": " + header.message);
}

}  // namespace geocage::reports
