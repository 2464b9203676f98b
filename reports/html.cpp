#include "reports/html.h"

#include <algorithm>
#include <cctype>
#include <cmath>

#include <fmt/format.h>

namespace geocage::reports {

namespace {

/// Three digits that count, no exponent.
std::string three_digits(double x, std::string_view unit) {
  if (std::isnan(x)) return "–";
  const double size = std::abs(x);
  const int decimals = size >= 99.95 ? 0 : size >= 9.995 ? 1 : 2;
  return fmt::format("{:.{}f}{}", x, decimals, unit);
}

}  // namespace

std::string escaped(std::string_view text) {
  std::string html;
  for (char c : text) switch (c) {
      case '&':
        html += "&amp;";
        break;
      case '<':
        html += "&lt;";
        break;
      case '>':
        html += "&gt;";
        break;
      case '"':
        html += "&quot;";
        break;
      case '\'':
        html += "&#39;";
        break;
      default:
        html += c;
    }
  return html;
}

std::string element(std::string_view name, std::string_view content, std::string_view attributes) {
  return fmt::format("<{}{}{}>{}</{}>", name, attributes.empty() ? "" : " ", attributes, content, name);
}

std::string plain_name(std::string_view text) {
  constexpr std::size_t longest = 100;  // with all that comes before and after, a file's name ends at 255
  std::string name(text.substr(0, longest));
  std::ranges::replace_if(
      name, [](unsigned char c) { return !std::isalnum(c) && c != '.' && c != '-'; }, '_');
  return name;
}

std::string millimetres(double metres) {
  return three_digits(metres * 1000, " mm");
}
std::string degrees(double radians) {
  return three_digits(radians * 57.29577951308232, "°");
}
std::string seconds(double time_s) {
  return three_digits(time_s, " s");
}
std::string percent(double share) {
  return fmt::format("{:.1f} %", 100 * share);
}

std::string table(const std::vector<std::vector<std::string>>& rows, std::string_view attributes) {
  std::string html;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    std::string cells;
    for (const auto& cell : rows[i]) cells += element(i == 0 ? "th" : "td", cell);
    const std::string row = element("tr", cells);
    html += i == 0 ? "<thead>" + row + "</thead><tbody>" : row;
  }
  return element("div", element("table", html + (rows.empty() ? "" : "</tbody>"), attributes),
                 "class=\"wide\"");
}

std::string fold(std::string_view title, std::string_view content) {
  return element("details", element("summary", title) + std::string(content));
}

std::string legend(const Scale& scale, std::string_view quantity, std::string (*text)(double),
                   std::string_view nan_label) {
  constexpr int steps = 64;
  std::string bar;
  for (int i = 0; i < steps; ++i)
    bar += fmt::format("<rect x=\"{:.3f}\" width=\"{:.3f}\" height=\"10\" fill=\"{}\"/>", 200.0 * i / steps,
                       200.0 / steps + 0.3,
                       css(scale.at(scale.low + (scale.high - scale.low) * i / (steps - 1))));
  const auto label = [&](double x, const char* anchor, double value) {
    return fmt::format("<text x=\"{}\" y=\"22\" text-anchor=\"{}\">{}</text>", x, anchor, text(value));
  };
  bar += label(0, "start", scale.low) + label(100, "middle", (scale.low + scale.high) / 2) +
         label(200, "end", scale.high);
  std::string html = element("span", escaped(quantity)) +
                     element("svg", bar, "class=\"legend\" viewBox=\"0 0 200 26\" role=\"img\"");
  if (!nan_label.empty())
    html += fmt::format("<span class=\"swatch\" style=\"background:{}\"></span><span>{}</span>",
                        css(scale.at(std::nan(""))), escaped(nan_label));
  return element("div", html, "class=\"key\"");
}

std::string interval_bar(const Proportion& p) {
  const std::string drawing = fmt::format(
      "<rect class=\"track\" width=\"200\" height=\"12\" rx=\"6\"/>"
      "<rect class=\"range\" x=\"{:.2f}\" width=\"{:.2f}\" height=\"12\" rx=\"3\"/>"
      "<circle class=\"mark\" cx=\"{:.2f}\" cy=\"6\" r=\"5\"/>",
      200 * p.low, 200 * (p.high - p.low), 200 * p.share);
  return element("svg", drawing, "class=\"interval\" viewBox=\"-6 0 212 12\" role=\"img\"");
}

std::string time_chart(const std::vector<TimeBar>& bars) {
  constexpr double left = 110, width = 420, row = 24;
  double longest = 1e-9;
  for (const TimeBar& bar : bars) longest = std::max(longest, bar.now_s + bar.earlier_s);
  std::string drawing;
  for (std::size_t i = 0; i < bars.size(); ++i) {
    const auto& [name, now, earlier] = bars[i];
    const double y = row * static_cast<double>(i), split = width * now / longest,
                 more = width * earlier / longest;
    drawing += fmt::format(
        "<text x=\"{}\" y=\"{}\" text-anchor=\"end\">{}</text><rect class=\"now\" x=\"{}\" y=\"{}\" "
        "width=\"{:.2f}\" "
        "height=\"14\"/><rect class=\"earlier\" x=\"{:.2f}\" y=\"{}\" width=\"{:.2f}\" height=\"14\"/><text "
        "x=\"{:.2f}\" "
        "y=\"{}\">{}</text>",
        left - 8, y + 15, escaped(name), left, y + 4, split, left + split, y + 4, more,
        left + split + more + 6, y + 15, seconds(now + earlier));
  }
  return element("svg", drawing,
                 fmt::format("class=\"chart\" viewBox=\"0 0 {} {}\" role=\"img\"", left + width + 70,
                             row * static_cast<double>(bars.size())));
}

}  // namespace geocage::reports
