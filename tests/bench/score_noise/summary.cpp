#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <map>
#include <sstream>

#include <fmt/format.h>

#include "tests/bench/score_noise/measure.h"

namespace geocage::study {

namespace fs = std::filesystem;

namespace {

struct Row {
  std::string object, field, direction;  ///< field: "winding hop 0.06"; local ones have their name alone
  double radius_m, share, sigma, spearman, overlap, drift_m;
};

std::vector<Row> read_rows(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.path().extension() == ".csv") files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  std::vector<Row> rows;
  for (const auto& file : files) {
    std::ifstream in(file);
    std::string line;
    std::getline(in, line);  // the header
    while (std::getline(in, line)) {
      std::vector<std::string> cells;
      std::istringstream text(line);
      for (std::string cell; std::getline(text, cell, ',');) cells.push_back(cell);
      const double radius = std::stod(cells[4]);
      const std::string field = radius > 0 ? cells[2] + " " + cells[3] + " " + cells[4] : cells[2];
      rows.push_back({cells[0], field, cells[8], radius, std::stod(cells[5]), std::stod(cells[9]),
                      std::stod(cells[11]), std::stod(cells[12]), std::stod(cells[13])});
    }
  }
  return rows;
}

/// Mean over objects of the means over an object's seeds; NaN (a constant field) is left out.
struct Mean {
  std::map<std::string, std::pair<double, int>> of_object;
  void add(const std::string& object, double x) {
    if (!std::isfinite(x)) return;
    of_object[object].first += x;
    ++of_object[object].second;
  }
  double value() const {
    double sum = 0;
    for (const auto& [object, total] : of_object) sum += total.first / total.second;
    return sum / static_cast<double>(of_object.size());
  }
};
struct Cell {
  Mean spearman, overlap, drift_m, drift_radii;  ///< the last: in radii of the ball; empty for local fields
};
/// field -> direction -> sigma -> means. Radii whose median ball holds more than half of the surface are
/// left out, object by object, as the stage `score` leaves them out.
using Table = std::map<std::string, std::map<std::string, std::map<double, Cell>>>;

Table table_of(const std::vector<Row>& rows) {
  Table table;
  for (const Row& row : rows) {
    if (row.share > 0.5) continue;
    Cell& cell = table[row.field][row.direction][row.sigma];
    cell.spearman.add(row.object, row.spearman);
    cell.overlap.add(row.object, row.overlap);
    cell.drift_m.add(row.object, row.drift_m);
    if (row.radius_m > 0) cell.drift_radii.add(row.object, row.drift_m / row.radius_m);
  }
  return table;
}

std::string markdown(const Table& table) {
  std::string text =
      "| field | noise | objects | sigma (edges) | Spearman | top 10 % overlap | drift of the best (mm) | in "
      "radii |\n"
      "|---|---|---|---|---|---|---|---|\n";
  for (const auto& [field, directions] : table)
    for (const auto& [direction, sigmas] : directions)
      for (const auto& [sigma, cell] : sigmas)
        text += fmt::format(
            "| {} | {} | {} | {} | {:.3f} | {:.3f} | {:.1f} | {} |\n", field, direction,
            cell.spearman.of_object.size(), sigma, cell.spearman.value(), cell.overlap.value(),
            1000 * cell.drift_m.value(),
            cell.drift_radii.of_object.empty() ? "-" : fmt::format("{:.2f}", cell.drift_radii.value()));
  return text;
}

/// Two plots side by side: rank correlation and overlap over sigma.
std::string picture(const Table& table) {
  const std::vector<std::array<std::string, 3>> lines = {
      {"winding hop 0.06", "S1, r = 60 mm", "#1b6ca8"},   {"winding hop 0.045", "S1, r = 45 mm", "#7fb2d8"},
      {"curvature hop 0.06", "S2, r = 60 mm", "#2a7f3f"}, {"curvature hop 0.045", "S2, r = 45 mm", "#8cc79a"},
      {"angle_defect", "angle defect", "#c23b22"},        {"jet_product", "k1 k2 of a quadric", "#e59866"}};
  std::string svg =
      "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 720 330' font-family='sans-serif' "
      "font-size='12'>\n"
      "<rect width='720' height='330' fill='white'/>\n";
  const auto x = [](int panel, double sigma) { return 50 + 350 * panel + 480 * sigma; };
  const auto y = [](double value) { return 260 - 220 * std::max(value, 0.0); };
  for (int panel : {0, 1}) {
    svg += fmt::format("<text x='{}' y='25'>{}</text>\n", x(panel, 0),
                       panel == 0 ? "rank correlation with the clean field" : "overlap of the best 10 %");
    for (double tick : {0.0, 0.25, 0.5, 0.75, 1.0})
      svg += fmt::format(
          "<path d='M{0} {2} H{1}' stroke='#ddd'/><text x='{3}' y='{4}' text-anchor='end'>{5}</text>\n",
          x(panel, 0), x(panel, 0.55), y(tick), x(panel, 0) - 6, y(tick) + 4, tick);
    for (double tick : {0.0, 0.1, 0.2, 0.3, 0.5})
      svg += fmt::format("<text x='{}' y='276' text-anchor='middle'>{}</text>\n", x(panel, tick), tick);
  }
  int row = 0;
  for (const auto& [field, label, colour] : lines) {
    const auto at = table.find(field);
    if (at == table.end() || !at->second.contains("normal")) continue;
    for (int panel : {0, 1}) {
      std::string way = fmt::format("M{} {}", x(panel, 0), y(1));
      for (const auto& [sigma, cell] : at->second.at("normal"))
        way += fmt::format(" L{:.1f} {:.1f}", x(panel, sigma),
                           y(panel == 0 ? cell.spearman.value() : cell.overlap.value()));
      svg += fmt::format("<path d='{}' fill='none' stroke='{}' stroke-width='2'/>\n", way, colour);
    }
    const int column = row % 3, below = row / 3;
    svg += fmt::format(
        "<rect x='{0}' y='{1}' width='14' height='4' fill='{2}'/><text x='{3}' y='{4}'>{5}</text>\n",
        50 + 220 * column, 297 + 18 * below, colour, 70 + 220 * column, 303 + 18 * below, label);
    ++row;
  }
  return svg + "</svg>\n";
}

}  // namespace

void summarise(const fs::path& folder) {
  const Table table = table_of(read_rows(folder));
  std::ofstream(folder / "summary.md") << markdown(table);
  std::ofstream(folder / "score-noise.svg") << picture(table);
}

}  // namespace geocage::study
