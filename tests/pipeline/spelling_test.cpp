#include "pipeline/spelling.h"

#include <gtest/gtest.h>

namespace geocage::pipeline {
namespace {

TEST(Spelling, PlainNamesAreUtf8WithoutControlCharacters) {
  for (const char* plain :
       {"", "mug", "a b", "quo\"te'", "\xc3\xa4", "\xe2\x82\xac", "\xf0\x9f\xa6\x86", "100%"})
    EXPECT_EQ(plain_name(plain), plain);
  EXPECT_EQ(plain_name("a\nb\x1b[31m\x7f"), "a%0Ab%1B[31m%7F");
  EXPECT_EQ(plain_name("t\xfcr"), "t%FCr");
  EXPECT_EQ(plain_name("\xc3"), "%C3");                       // cut
  EXPECT_EQ(plain_name("\xc0\xaf"), "%C0%AF");                // overlong
  EXPECT_EQ(plain_name("\xe0\x80\xaf"), "%E0%80%AF");         // overlong
  EXPECT_EQ(plain_name("\xed\xa0\x80"), "%ED%A0%80");         // surrogate
  EXPECT_EQ(plain_name("\xf4\x90\x80\x80"), "%F4%90%80%80");  // above 10FFFF
  EXPECT_EQ(plain_name("\xc2\x9b"), "%C2%9B");                // CSI
}

TEST(Spelling, PlainTextIsNotObeyed) {
  EXPECT_EQ(plain_text("a\tb\nt\xfcr"), "a\tb\nt\xfcr");
  EXPECT_EQ(plain_text(std::string("a\0\r\x1b[2J\x7f", 8)), "a\\x00\\x0d\\x1b[2J\\x7f");
}

TEST(Spelling, OthersReadWhatWasMeant) {
  EXPECT_EQ(for_shell("mug/import"), "mug/import");
  EXPECT_EQ(for_shell("quo'te"), "'quo'\\''te'");
  EXPECT_EQ(for_shell("$(x)"), "'$(x)'");
  EXPECT_EQ(for_csv("a b"), "a b");
  EXPECT_EQ(for_csv("a,\"b\""), "\"a,\"\"b\"\"\"");
  EXPECT_EQ(for_dot("a\"b\\n"), "\"a\\\"b\\\\n\"");
}

}  // namespace
}  // namespace geocage::pipeline
