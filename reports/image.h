#pragma once
#include <cstdint>
#include <filesystem>
#include <vector>

namespace geocage::reports {

/// Eight bits a channel, red green blue alpha (not premultiplied), rows from the top.
struct Image {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgba;
};
/// std::system_error when the file can't be written.
void write_png(const std::filesystem::path& file, const Image& image);
/// As write_png with at most 256 colours of five bits a channel, a quarter of the bytes: the most frequent
/// ones, and each other pixel the nearest of them.
void write_indexed_png(const std::filesystem::path& file, const Image& image);

}  // namespace geocage::reports
