#include "cli/table.h"

#include <cmath>
#include <fstream>
#include <memory>
#include <system_error>

#include <fmt/format.h>
#include <sqlite3.h>

#include "pipeline/error.h"
#include "pipeline/spelling.h"

namespace geocage::cli {

namespace fs = std::filesystem;

namespace {

using Database = std::unique_ptr<sqlite3, decltype(&sqlite3_close)>;
using Statement = std::unique_ptr<sqlite3_stmt, decltype(&sqlite3_finalize)>;

Database open_database(const fs::path& file, int flags) {
  sqlite3* raw = nullptr;
  const int answer = sqlite3_open_v2(file.c_str(), &raw, flags, nullptr);
  Database database(raw, &sqlite3_close);
  if (answer != SQLITE_OK)
    throw std::system_error(EIO, std::generic_category(), file.string() + ": " + sqlite3_errstr(answer));
  return database;
}

/// Our own statements: what fails is the disk.
void execute(sqlite3* database, const std::string& sql) {
  if (sqlite3_exec(database, sql.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK)
    throw std::system_error(EIO, std::generic_category(), sqlite3_errmsg(database));
}

std::string name_of(const std::string& column) {
  return "\"" + column + "\"";
}

void bind(sqlite3_stmt* statement, int place, const Cell& cell) {
  if (const auto* number = std::get_if<double>(&cell)) {
    if (*number == std::floor(*number) && std::abs(*number) < 1e15)
      sqlite3_bind_int64(statement, place, static_cast<sqlite3_int64>(*number));
    else
      sqlite3_bind_double(statement, place, *number);
  } else if (const auto* text = std::get_if<std::string>(&cell)) {
    sqlite3_bind_text(statement, place, text->c_str(), -1, SQLITE_TRANSIENT);
  } else {
    sqlite3_bind_null(statement, place);
  }
}

Statement prepare(sqlite3* database, const std::string& sql) {
  sqlite3_stmt* raw = nullptr;
  if (sqlite3_prepare_v2(database, sql.c_str(), -1, &raw, nullptr) != SQLITE_OK)
    throw std::system_error(EIO, std::generic_category(), sqlite3_errmsg(database));
  return {raw, &sqlite3_finalize};
}

void add_table(sqlite3* database, const Table& table) {
  std::string names, places;
  for (const auto& column : table.columns) {
    names += (names.empty() ? "" : ", ") + name_of(column);
    places += places.empty() ? "?" : ", ?";
  }
  execute(database, "create table " + table.name + " (" + names + ")");
  const Statement insert = prepare(database, "insert into " + table.name + " values (" + places + ")");
  for (const auto& row : table.rows) {
    for (std::size_t i = 0; i < row.size(); ++i) bind(insert.get(), static_cast<int>(i) + 1, row[i]);
    if (sqlite3_step(insert.get()) != SQLITE_DONE)
      throw std::system_error(EIO, std::generic_category(), sqlite3_errmsg(database));
    sqlite3_reset(insert.get());
  }
}

Cell cell_of(sqlite3_stmt* statement, int column) {
  switch (sqlite3_column_type(statement, column)) {
    case SQLITE_NULL:
      return {};
    case SQLITE_INTEGER:
    case SQLITE_FLOAT:
      return sqlite3_column_double(statement, column);
    default:
      return std::string(reinterpret_cast<const char*>(sqlite3_column_text(statement, column)));
  }
}

}  // namespace

std::string cell_text(const Cell& cell) {
  if (const auto* number = std::get_if<double>(&cell)) return fmt::format("{}", *number);
  const auto* text = std::get_if<std::string>(&cell);
  return text ? *text : "";
}

std::string csv_text(const Table& table) {
  std::string text;
  const auto add = [&](const std::string& word, bool first) {
    text += (first ? "" : ",") + pipeline::for_csv(word);
  };
  for (std::size_t i = 0; i < table.columns.size(); ++i) add(table.columns[i], i == 0);
  text += "\n";
  for (const auto& row : table.rows) {
    for (std::size_t i = 0; i < row.size(); ++i) add(cell_text(row[i]), i == 0);
    text += "\n";
  }
  return text;
}

void write_database(const std::vector<Table>& tables, const fs::path& file) {
  const fs::path beside = file.string() + ".new";
  fs::remove(beside);
  {
    const Database database = open_database(beside, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE);
    execute(database.get(), "pragma journal_mode = off; pragma synchronous = off; begin");
    for (const auto& table : tables) add_table(database.get(), table);
    execute(database.get(), "commit");
  }
  fs::rename(beside, file);
}

Table select_from(const fs::path& file, const std::string& statement) {
  if (!fs::is_regular_file(file))
    throw pipeline::UserError(pipeline::Fault::configuration, file.string(), "there is no table of results",
                              "`geocage run` writes it; --out or --database say where it is");
  const Database database = open_database(file, SQLITE_OPEN_READONLY);
  const auto refuse = [&](const std::string& sentence) {
    throw pipeline::UserError(
        pipeline::Fault::configuration, "query", sentence,
        "tables: grasps, rates, paired, losses, agreement, slots; names with a dot stand in double quotes");
  };
  sqlite3_stmt* raw = nullptr;
  const char* rest = nullptr;
  if (sqlite3_prepare_v2(database.get(), statement.c_str(), -1, &raw, &rest) != SQLITE_OK)
    refuse(sqlite3_errmsg(database.get()));
  const Statement select(raw, &sqlite3_finalize);
  if (!raw) refuse("the statement is empty");
  if (!sqlite3_stmt_readonly(raw) || sqlite3_column_count(raw) == 0)
    refuse("only statements that read are allowed");
  if (std::string(rest).find_first_not_of(" \t\r\n;") != std::string::npos) refuse("one statement at a time");
  Table table{"answer", {}, {}};
  for (int i = 0; i < sqlite3_column_count(raw); ++i) table.columns.emplace_back(sqlite3_column_name(raw, i));
  int answer;
  while ((answer = sqlite3_step(raw)) == SQLITE_ROW) {
    auto& row = table.rows.emplace_back();
    for (int i = 0; i < sqlite3_column_count(raw); ++i) row.push_back(cell_of(raw, i));
  }
  if (answer != SQLITE_DONE) refuse(sqlite3_errmsg(database.get()));
  return table;
}

}  // namespace geocage::cli
