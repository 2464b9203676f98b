#include <cerrno>
#include <cstring>
#include <sstream>
#include <system_error>

#include "geometry/mesh.h"
#include "pipeline/text_file.h"

namespace geocage::geometry {

namespace fs = std::filesystem;

namespace {

template <class Number>
void put(std::string& bytes, Number x) {
  bytes.append(reinterpret_cast<const char*>(&x), sizeof x);
}
template <class Number>
Number take(const char*& at) {
  Number x;
  std::memcpy(&x, at, sizeof x);
  at += sizeof x;
  return x;
}

[[noreturn]] void throw_unreadable(const fs::path& file) {
  throw std::system_error(EIO, std::generic_category(), file.string() + ": not a mesh of the store");
}

/// Counts and names of our own header.
struct Header {
  std::size_t vertices = 0, triangles = 0, size = 0;
  std::vector<std::string> fields;
};

Header read_header(const std::string& bytes, const fs::path& file) {
  Header header;
  const auto end = bytes.find("end_header\n");
  if (!bytes.starts_with("ply\n") || end == std::string::npos) throw_unreadable(file);
  header.size = end + 11;
  std::istringstream in(bytes.substr(0, end));
  for (std::string word; in >> word;) {
    std::string kind, name;
    if (word == "element") {
      in >> kind;
      in >> (kind == "vertex" ? header.vertices : header.triangles);
    } else if (word == "property" && in >> kind >> name && kind == "double" && name.size() > 1) {
      header.fields.push_back(name);
    }
  }
  const std::size_t row = 8 * (3 + header.fields.size());
  if (bytes.size() != header.size + header.vertices * row + header.triangles * 13) throw_unreadable(file);
  return header;
}

}  // namespace

void write_ply(const fs::path& file, const TriangleMesh& mesh, const std::vector<VertexField>& fields) {
  std::string bytes = "ply\nformat binary_little_endian 1.0\nelement vertex " +
                      std::to_string(mesh.vertices.size()) +
                      "\nproperty double x\nproperty double y\nproperty double z\n";
  for (const auto& field : fields) bytes += "property double " + field.name + "\n";
  bytes += "element face " + std::to_string(mesh.triangles.size()) +
           "\nproperty list uchar int vertex_indices\nend_header\n";
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    for (int i = 0; i < 3; ++i) put(bytes, mesh.vertices[v][i]);
    for (const auto& field : fields) put(bytes, field.values[v]);
  }
  for (const auto& t : mesh.triangles) {
    put(bytes, static_cast<unsigned char>(3));
    for (std::int32_t v : t) put(bytes, v);
  }
  pipeline::write_text(file, bytes);
}

TriangleMesh read_own_ply(const fs::path& file, std::vector<VertexField>* fields) {
  const std::string bytes = pipeline::read_text(file);
  const Header header = read_header(bytes, file);

  TriangleMesh mesh;
  mesh.vertices.resize(header.vertices);
  mesh.triangles.resize(header.triangles);
  std::vector<VertexField> columns;
  for (const auto& name : header.fields) columns.push_back({name, std::vector<double>(header.vertices)});
  const char* at = bytes.data() + header.size;
  for (std::size_t v = 0; v < header.vertices; ++v) {
    for (int i = 0; i < 3; ++i) mesh.vertices[v][i] = take<double>(at);
    for (auto& column : columns) column.values[v] = take<double>(at);
  }
  for (auto& t : mesh.triangles) {
    ++at;
    for (int& v : t) v = take<std::int32_t>(at);
  }
  if (fields) *fields = std::move(columns);
  return mesh;
}

std::string_view artefact_kind(const TriangleMesh*) {
  return "mesh";
}
void save_artefact(const TriangleMesh& mesh, const fs::path& dir) {
  std::vector<VertexField> fields;
  if (!mesh.observed.empty()) fields.push_back({"observed", mesh.observed});
  write_ply(dir / "mesh.ply", mesh, fields);
}
void load_artefact(TriangleMesh& mesh, const fs::path& dir) {
  std::vector<VertexField> fields;
  mesh = read_own_ply(dir / "mesh.ply", &fields);
  for (auto& field : fields)
    if (field.name == "observed") mesh.observed = std::move(field.values);
}

}  // namespace geocage::geometry
