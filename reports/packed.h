#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace geocage::reports {

/// RFC 4648, with padding.
std::string base64(std::span<const std::uint8_t> bytes);
/// Base64 of the bytes in zlib's format (RFC 1950): what a browser's DecompressionStream("deflate") opens.
std::string packed(std::span<const std::uint8_t> bytes);
std::string packed(std::string_view text);

}  // namespace geocage::reports
