#include "topology/polyline.h"

#include <fstream>

#include <gtest/gtest.h>

#include "pipeline/error.h"
#include "tests/pipeline/scratch_folder.h"

namespace geocage::topology {
namespace {

class PolylineFile : public ::testing::Test {
 protected:
  Polyline read(const std::string& text) {
    std::ofstream(folder_ / "line.csv") << text;
    return read_polyline(folder_ / "line.csv");
  }
  /// Where the refusal points to, after the folder.
  std::string refused_at(const std::string& text) {
    try {
      read(text);
    } catch (const pipeline::UserError& error) {
      EXPECT_EQ(error.fault(), pipeline::Fault::input);
      return std::filesystem::path(error.where()).filename().string();
    }
    return "read";
  }
  tests::ScratchFolder folder_;
};

TEST_F(PolylineFile, ReadsNumbersBlankLinesAndCarriageReturns) {
  const auto points = read("0,0,0\r\n\n 1e-3, -2 ,3.5\n");
  ASSERT_EQ(points.size(), 2u);
  EXPECT_EQ(points[1], Vec3(1e-3, -2, 3.5));
}

TEST_F(PolylineFile, NamesTheLineThatIsWrong) {
  EXPECT_EQ(refused_at("0,0,0\n1,2\n3,4,5\n"), "line.csv:2");
  EXPECT_EQ(refused_at("x,y,z\n0,0,0\n1,1,1\n"), "line.csv:1");
  EXPECT_EQ(refused_at("0,0,0\n1 2 3\n"), "line.csv:2");
  EXPECT_EQ(refused_at("0,0,0\n1,2,3,4\n"), "line.csv:2");
  EXPECT_EQ(refused_at("0,0,0\n\n1,nan,3\n"), "line.csv:3");
  EXPECT_EQ(refused_at("0,0,0\n"), "line.csv");
  EXPECT_EQ(refused_at(""), "line.csv");
}

TEST_F(PolylineFile, MissingFile) {
  EXPECT_THROW(read_polyline(folder_ / "none.csv"), pipeline::UserError);
}

}  // namespace
}  // namespace geocage::topology
