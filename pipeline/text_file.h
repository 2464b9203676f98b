#pragma once
#include <filesystem>
#include <string>
#include <string_view>

namespace geocage::pipeline {

/// The bytes of a file. std::system_error with its path when it can't be read.
std::string read_text(const std::filesystem::path& file);

/// The file holds these bytes then. std::system_error with its path when the disk does not take them all.
void write_text(const std::filesystem::path& file, std::string_view text);

/// The same, whole or not at all, however many do so at once: written beside and renamed.
void replace_text(const std::filesystem::path& file, std::string_view text);

}  // namespace geocage::pipeline
