#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "reports/colours.h"
#include "reports/statistics.h"

namespace geocage::reports {

/// Text as HTML shows it: & < > " ' are escaped.
std::string escaped(std::string_view text);
/// `<name attributes>content</name>`; the content is HTML already.
std::string element(std::string_view name, std::string_view content, std::string_view attributes = "");
/// A name that is safe in files, ids and addresses: letters, digits, dot, dash; others become '_'. At most
/// 100 of them: whoever needs it unique puts a number before it.
std::string plain_name(std::string_view text);

/// "12 mm", "3.4°", "1.5 s": two or three digits that count; "–" for NaN.
std::string millimetres(double metres);
std::string degrees(double radians);
std::string seconds(double time_s);
std::string percent(double share);

/// A table; cells are HTML already, the first row is the head.
std::string table(const std::vector<std::vector<std::string>>& rows, std::string_view attributes = "");
/// What a click opens.
std::string fold(std::string_view title, std::string_view content);

/// The scale as a bar with its ends and middle written below; `nan_label` names the grey, if it is not empty.
std::string legend(const Scale& scale, std::string_view quantity, std::string (*text)(double),
                   std::string_view nan_label);
/// A bar from 0 to 100 % with the share and its interval.
std::string interval_bar(const Proportion& proportion);

/// Bars of seconds: spent now, and spent earlier for what was found in the store.
struct TimeBar {
  std::string name;
  double now_s = 0, earlier_s = 0;
};
std::string time_chart(const std::vector<TimeBar>& bars);

}  // namespace geocage::reports
