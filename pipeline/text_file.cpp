#include "pipeline/text_file.h"

#include <cerrno>
#include <fstream>
#include <sstream>
#include <system_error>

#include <unistd.h>

namespace geocage::pipeline {

namespace fs = std::filesystem;

namespace {
[[noreturn]] void throw_errno(const fs::path& file) {
  throw std::system_error(errno != 0 ? errno : EIO, std::generic_category(), file.string());
}
}  // namespace

std::string read_text(const fs::path& file) {
  errno = 0;
  std::ifstream in(file, std::ios::binary);
  if (!in) throw_errno(file);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

void write_text(const fs::path& file, std::string_view text) {
  errno = 0;
  std::ofstream out(file, std::ios::binary);
  out << text;
  out.close();
  if (!out) throw_errno(file);
}

void replace_text(const fs::path& file, std::string_view text) {
  const fs::path fresh = file.string() + "." + std::to_string(getpid()) + ".new";
  try {
    write_text(fresh, text);
    fs::rename(fresh, file);
  } catch (...) {
    std::error_code ignored;
    fs::remove(fresh, ignored);
    throw;
  }
}

}  // namespace geocage::pipeline
