#include "reports/image.h"

#include <cerrno>
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

}  // namespace geocage::reports
