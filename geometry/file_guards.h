#pragma once
#include <cstdint>
#include <filesystem>
#include <string>

namespace geocage::geometry {

/// Refuses what no reader should be given: missing, a folder, not a regular file, empty. UserError (input).
void guard_file(const std::filesystem::path& file);

/// What a PLY's header declares. Both counts are checked against the file's size: a header that promises
/// more than the file can hold is a UserError (input).
struct PlyCounts {
  std::uint64_t vertices = 0, faces = 0;
};
PlyCounts guard_ply(const std::filesystem::path& file);

/// A PCD header without its end or with an unknown type or kind of data, or one that promises more points
/// than the guard allows or the file can hold, is a UserError (input).
void guard_pcd(const std::filesystem::path& file);

/// A byte-order mark, or decimal commas in the vertices, of a text OBJ, OFF, STL or PLY are a UserError
/// (input): readers lose the first line, or stop at the comma and go on with another number.
void guard_text_mesh(const std::filesystem::path& file);

/// A binary STL whose declared triangles are not what the file holds is a UserError (input).
void guard_stl(const std::filesystem::path& file);

/// A text OFF with fewer vertices or faces than it promises, or with a face that names a vertex which it does
/// not have, is a UserError (input): assimp takes the last vertex instead, or leaves the face out.
void guard_off(const std::filesystem::path& file);

/// Triangles that the header of a PLY, OFF or binary STL declares; 0 for other formats, which tell only when
/// they are read. Errors: as guard_ply.
std::uint64_t declared_faces(const std::filesystem::path& file);

/// The bytes of a binary PLY whose header ends in LF and whose numbers begin with the byte of another one,
/// with a CR before the header's last LF; empty for all others.
std::string ply_with_cr(const std::filesystem::path& file);

/// File ending in lower case, with its dot.
std::string ending_of(const std::filesystem::path& file);

constexpr std::uint64_t most_faces = 10'000'000;
constexpr std::uint64_t most_points = 50'000'000;

}  // namespace geocage::geometry
