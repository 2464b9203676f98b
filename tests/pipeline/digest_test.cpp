#include "pipeline/digest.h"

#include <cstdio>
#include <fstream>
#include <system_error>

#include <gtest/gtest.h>

#include "tests/pipeline/scratch_folder.h"

namespace geocage::pipeline {
namespace {

// FIPS 180-4, examples B.1 and of the empty message.
TEST(Digest, StandardVectors) {
  EXPECT_EQ(sha256_of("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sha256_of(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
}

TEST(Digest, StreamInPiecesIsTheWhole) {
  Sha256 pieces;
  pieces.add("a");
  pieces.add("");
  pieces.add("bc");
  EXPECT_EQ(pieces.hex(), sha256_of("abc"));
}

TEST(Digest, ListingIsWhatCoreutilsPrint) {
  const tests::ScratchFolder folder;
  for (const char* name : {"b.ply", "a.json", "B.txt"}) std::ofstream(folder / name) << "content of " << name;
  const std::string command = "cd '" + folder.path().string() + "' && LC_ALL=C sha256sum *";
  FILE* pipe = popen(command.c_str(), "r");
  ASSERT_NE(pipe, nullptr);
  std::string printed(1000, '\0');
  printed.resize(fread(printed.data(), 1, printed.size(), pipe));
  pclose(pipe);
  EXPECT_EQ(sha256_listing(folder.path()), printed);
}

TEST(Digest, MissingFileIsNamed) {
  try {
    sha256_of_file("no/such/file");
    FAIL();
  } catch (const std::system_error& error) {
    EXPECT_NE(std::string(error.what()).find("no/such/file"), std::string::npos);
  }
}

}  // namespace
}  // namespace geocage::pipeline
