#include "reports/html.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/reports/html_check.h"

namespace geocage::reports {
namespace {

TEST(HtmlCheck, FindsFlaws) {
  EXPECT_EQ(html_flaw("<p title=\"a > b\">x &amp; y<img src=\"a\"></p>"), "");
  for (const char* bad : {"<p>", "<p></b>", "</p>", "<p>a & b</p>", "<p>a < b</p>", "<p title=\"x></p>"})
    EXPECT_NE(html_flaw(bad), "") << bad;
}

TEST(Html, EscapesWhatWouldBeMarkup) {
  EXPECT_EQ(escaped("<a href=\"x\">'&'"), "&lt;a href=&quot;x&quot;&gt;&#39;&amp;&#39;");
  EXPECT_EQ(plain_name("../mug <1>&"), ".._mug__1__");
  EXPECT_EQ(plain_name(std::string(300, 'x')), std::string(100, 'x'));
}

TEST(Html, NumbersKeepThreeDigitsAndTheirUnit) {
  EXPECT_EQ(millimetres(0.0123456), "12.3 mm");
  EXPECT_EQ(millimetres(0.5), "500 mm");
  EXPECT_EQ(degrees(std::acos(-1)), "180°");
  EXPECT_EQ(seconds(1.234), "1.23 s");
  EXPECT_EQ(percent(0.6573), "65.7 %");
  EXPECT_EQ(millimetres(std::nan("")), "–");
}

TEST(Html, DrawingsAreWellFormed) {
  const Scale scale{Scale::Map::diverging, -1, 1};
  for (const std::string& html :
       {legend(scale, "a < b", &degrees, "none & nothing"), interval_bar(wilson(3, 4)),
        time_chart({{"a<b", 1, 2}}), table({{"a", "b"}, {"1", "2"}}, "class=\"x\""), table({}),
        fold("more", "text")})
    EXPECT_EQ(html_flaw(html), "") << html;
}

}  // namespace
}  // namespace geocage::reports
