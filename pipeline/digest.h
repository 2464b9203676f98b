#pragma once
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

namespace geocage::pipeline {

/// SHA-256 of a stream of bytes (libcrypto).
class Sha256 {
 public:
  Sha256();
  ~Sha256();
  void add(std::string_view bytes);
  std::string hex();  ///< ends the stream

 private:
  struct Context;
  std::unique_ptr<Context> context_;
};

std::string sha256_of(std::string_view bytes);
/// Streamed. std::system_error when the file can't be read.
std::string sha256_of_file(const std::filesystem::path& file);

/// What `sha256sum *` prints inside `folder` (names in byte order): the name of an artefact is its digest.
/// A folder has no digest and a line of its own. std::system_error when a file can't be read.
std::string sha256_listing(const std::filesystem::path& folder);

}  // namespace geocage::pipeline
