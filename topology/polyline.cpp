#include "topology/polyline.h"

#include <fstream>
#include <sstream>

#include "pipeline/error.h"

namespace geocage::topology {

Polyline read_polyline(const std::filesystem::path& file) {
  const auto refuse = [&](const std::string& where, const std::string& sentence) {
    throw pipeline::UserError(pipeline::Fault::input, where, sentence, "a polyline is one x,y,z a line");
  };
  std::error_code error;
  const auto kind = std::filesystem::status(file, error).type();
  if (kind == std::filesystem::file_type::not_found) refuse(file.string(), "there is no such file");
  if (kind != std::filesystem::file_type::regular) refuse(file.string(), "this is not a regular file");
  std::ifstream in(file);
  Polyline points;
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
    std::istringstream cells(line);
    Vec3 p;
    char comma = ',';
    for (int i = 0; i < 3; ++i) {
      if (i > 0 && (!(cells >> comma) || comma != ',')) comma = 0;
      if (!(cells >> p[i])) comma = 0;
    }
    std::string rest;
    if (comma != ',' || cells >> rest || !p.allFinite())
      refuse(file.string() + ":" + std::to_string(number),
             "'" + line.substr(0, 60) + "' is not three numbers");
    points.push_back(p);
  }
  if (points.size() < 2) refuse(file.string(), "a polyline needs at least two points");
  return points;
}

}  // namespace geocage::topology
