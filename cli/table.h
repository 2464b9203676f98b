#pragma once
#include <filesystem>
#include <string>
#include <variant>
#include <vector>

namespace geocage::cli {

/// Nothing, a number or a text.
using Cell = std::variant<std::monostate, double, std::string>;

struct Table {
  std::string name;
  std::vector<std::string> columns;
  std::vector<std::vector<Cell>> rows;
};

/// "" for nothing, the shortest digits that read back for a number.
std::string cell_text(const Cell& cell);
/// RFC 4180; a header line first.
std::string csv_text(const Table& table);

/// A database with these tables, moved to its place when it is whole. Errors: std::system_error.
void write_database(const std::vector<Table>& tables, const std::filesystem::path& file);
/// Answers of one statement that changes nothing. UserError (configuration) for a database that is not there
/// and for a statement that SQLite refuses or that would write.
Table select_from(const std::filesystem::path& file, const std::string& statement);

}  // namespace geocage::cli
