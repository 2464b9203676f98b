#include <cerrno>
#include <fstream>
#include <sstream>
#include <system_error>

#include <nlohmann/json.hpp>

#include "geometry/distance_field.h"
#include "pipeline/text_file.h"

namespace geocage::geometry {

namespace fs = std::filesystem;
using nlohmann::json;

namespace {

template <class Number>
void write_numbers(std::ostream& out, const std::vector<Number>& numbers) {
  out.write(reinterpret_cast<const char*>(numbers.data()),
            static_cast<std::streamsize>(numbers.size() * sizeof(Number)));
}
template <class Number>
void read_numbers(std::istream& in, std::vector<Number>& numbers) {
  in.read(reinterpret_cast<char*>(numbers.data()),
          static_cast<std::streamsize>(numbers.size() * sizeof(Number)));
}
template <class Stream>
void expect(const Stream& stream, const fs::path& file) {
  if (!stream) throw std::system_error(errno ? errno : EIO, std::generic_category(), file.string());
}

/// A text header that ParaView and 3D Slicer read, then the nodes, x fastest.
std::string nrrd_header(const SignedDistanceField& field) {
  json numbers = {field.origin.x(), field.origin.y(), field.origin.z(),
                  field.cell_m};  // shortest exact digits
  const std::string h = numbers[3].dump();
  std::ostringstream header;
  header << "NRRD0004\ntype: float\ndimension: 3\nsizes: " << field.nodes[0] << " " << field.nodes[1] << " "
         << field.nodes[2] << "\nspace dimension: 3\nspace directions: (" << h << ",0,0) (0," << h
         << ",0) (0,0," << h << ")\nspace origin: (" << numbers[0].dump() << "," << numbers[1].dump() << ","
         << numbers[2].dump() << ")\nspace units: \"m\" \"m\" \"m\"\nendian: little\nencoding: raw\n\n";
  return header.str();
}

}  // namespace

std::string_view artefact_kind(const SignedDistanceField*) {
  return "field";
}

void save_artefact(const SignedDistanceField& field, const fs::path& dir) {
  std::ofstream coarse(dir / "coarse.nrrd", std::ios::binary);
  coarse << nrrd_header(field);
  write_numbers(coarse, field.coarse);
  expect(coarse.flush(), dir / "coarse.nrrd");
  std::ofstream blocks(dir / "blocks.bin", std::ios::binary);
  write_numbers(blocks, field.block);
  write_numbers(blocks, field.fine);
  expect(blocks.flush(), dir / "blocks.bin");
  const json meta = {{"schema", "geocage-field 2"},
                     {"origin_m", {field.origin.x(), field.origin.y(), field.origin.z()}},
                     {"cell_m", field.cell_m},
                     {"nodes", field.nodes},
                     {"fine_nodes", field.fine.size()}};
  pipeline::write_text(dir / "field.json", meta.dump(1) + "\n");
}

void load_artefact(SignedDistanceField& field, const fs::path& dir) {
  std::ifstream meta(dir / "field.json");
  expect(meta, dir / "field.json");
  const json read = json::parse(meta);
  for (int i = 0; i < 3; ++i) field.origin[i] = read["origin_m"][i];
  field.cell_m = read["cell_m"];
  field.nodes = read["nodes"].get<std::array<int, 3>>();
  const auto& n = field.nodes;
  field.coarse.resize(std::size_t(n[0]) * n[1] * n[2]);
  if (!field.coarse.empty()) field.block.resize(std::size_t(n[0] - 1) * (n[1] - 1) * (n[2] - 1));
  field.fine.resize(read["fine_nodes"]);
  std::ifstream coarse(dir / "coarse.nrrd", std::ios::binary);
  coarse.seekg(static_cast<std::streamoff>(nrrd_header(field).size()));
  read_numbers(coarse, field.coarse);
  expect(coarse, dir / "coarse.nrrd");
  std::ifstream blocks(dir / "blocks.bin", std::ios::binary);
  read_numbers(blocks, field.block);
  read_numbers(blocks, field.fine);
  expect(blocks, dir / "blocks.bin");
  field.mark();
}

}  // namespace geocage::geometry
