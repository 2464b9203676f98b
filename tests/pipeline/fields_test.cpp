#include "pipeline/fields.h"

#include <cmath>

#include <gtest/gtest.h>

namespace geocage::pipeline {
namespace {

struct Everything {
  bool flag = true;
  int count = -3;
  std::uint64_t seed = 18446744073709551615u;
  double length_m = 0.1;
  std::string metric = "hop";
  std::vector<double> radii_m = {0.5, 1e-9};
  std::vector<std::string> names = {"a\"b", "c"};
  void visit(Fields& f) {
    f("flag", flag, "a flag");
    f("count", count, {-5, 5}, "a count");
    f("seed", seed, "a seed");
    f("length_m", length_m, {0, 1}, "a length");
    f("metric", metric, {"hop", "dijkstra"}, "a choice");
    f("radii_m", radii_m, {0}, "a list");
    f("names", names, {}, "texts");
  }
};

TEST(Fields, ValuesAreReadableAndShort) {
  Everything e;
  const Fields fields = fields_of(e);
  std::vector<std::string> texts;
  for (const auto& field : fields.list()) texts.push_back(value_text(field));
  const std::vector<std::string> expected = {"true",    "-3",           "18446744073709551615", "0.1",
                                             "\"hop\"", "[0.5, 1e-09]", "[\"a\\\"b\", \"c\"]"};
  EXPECT_EQ(texts, expected);
}

TEST(Fields, NumbersReadBackExactly) {
  for (double x : {0.1, 1.0 / 3, 1e-300, 123456789.123456789, std::nextafter(1.0, 2.0)}) {
    Field field{"x", &x, {}, {}, ""};
    EXPECT_EQ(std::stod(value_text(field)), x);
  }
}

TEST(Fields, MinusZeroIsZero) {
  double x = -0.0;
  EXPECT_EQ(value_text({"x", &x, {}, {}, ""}), "0");
}

TEST(Fields, TypesInWords) {
  Everything e;
  const Fields fields = fields_of(e);
  EXPECT_EQ(type_text(fields.list()[1]), "whole number in [-5, 5]");
  EXPECT_EQ(type_text(fields.list()[4]), "text, one of: hop, dijkstra");
  EXPECT_EQ(type_text(fields.list()[5]), "list of numbers >= 0");
}

struct Sizes {
  std::string size_by = "edge";
  std::vector<std::string> noise = {"kinect", "missing"};
  double edge_m = 1, sigma_m = 1, share = 1;
  void visit(Fields& f) {
    f("size_by", size_by, {"edge", "count"}, "");
    f("noise", noise, {"gaussian", "kinect", "missing"}, "");
    f("edge_m", edge_m, {0, 2}, "").only_with("size_by", {"edge"});
    f("sigma_m", sigma_m, {0, 2}, "").only_with("noise", {"gaussian", "kinect"});
    f("share", share, {0, 2}, "");
  }
};

TEST(Fields, TellWhyTheyDoNothing) {
  Sizes sizes;
  const Fields fields = fields_of(sizes);
  const auto why = [&](int i) { return why_idle(fields.list()[i], fields); };
  for (int i = 0; i < 5; ++i) EXPECT_EQ(why(i), "");
  sizes.size_by = "count";
  sizes.noise = {"missing"};
  EXPECT_EQ(why(2), "size_by is \"count\", and edge_m counts with \"edge\"");
  EXPECT_EQ(why(3), "noise is [\"missing\"], and sigma_m counts with \"gaussian\" or \"kinect\"");
  EXPECT_EQ(why(4), "");
  EXPECT_EQ(type_text(fields.list()[2]), "number in [0, 2]; with size_by \"edge\"");
}

}  // namespace
}  // namespace geocage::pipeline
