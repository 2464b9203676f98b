#include "pipeline/store.h"

#include <fstream>
#include <sstream>

#include <gtest/gtest.h>

#include "pipeline/digest.h"
#include "pipeline/error.h"
#include "tests/pipeline/scratch_folder.h"

namespace geocage::pipeline {
namespace {

namespace fs = std::filesystem;

std::string publish(const Store& store, const std::string& text) {
  const auto folder = store.scratch();
  std::ofstream(folder / "value.txt") << text;
  return store.publish(folder);
}

Record record_of(const Store& store, const std::string& recipe, const std::string& text) {
  Record record;
  record.recipe = recipe;
  record.content = publish(store, text);
  record.metrics = {{"vertices", 12}, {"share of x", 0.1}};
  record.seconds = 1.5;
  record.made_at = "2000-01-01T00:00:00Z";
  record.host = "h";
  record.program = "p";
  store.write(record);
  return record;
}

void overwrite(const fs::path& file, std::size_t offset, char byte) {
  fs::permissions(file, fs::perms::owner_write, fs::perm_options::add);
  std::fstream out(file, std::ios::in | std::ios::out | std::ios::binary);
  out.seekp(static_cast<std::streamoff>(offset));
  out.put(byte);
}

TEST(Store, RecordReadsBackWhole) {
  const tests::ScratchFolder folder;
  const Store store(folder / "store");
  const Record written = record_of(store, "geocage-recipe 1\nstage a\nparam x = 1\n", "hello");
  const auto read = store.find(written.key());
  ASSERT_TRUE(read);
  EXPECT_EQ(read->recipe, written.recipe);
  EXPECT_EQ(read->content, written.content);
  EXPECT_EQ(read->metrics, written.metrics);
  EXPECT_EQ(read->seconds, 1.5);
  EXPECT_EQ(read->host, "h");
}

TEST(Store, ContentIsTheDigestOfTheListing) {
  const tests::ScratchFolder folder;
  const Store store(folder / "store");
  const auto content = publish(store, "hello");
  EXPECT_EQ(content, sha256_of(sha256_of("hello") + "  value.txt\n"));
  EXPECT_EQ(publish(store, "hello"), content);
  EXPECT_NE(publish(store, "other"), content);
}

TEST(Store, EveryFlippedByteIsFoundAndQuarantined) {
  const tests::ScratchFolder folder;
  const Store store(folder / "store");
  const std::string text = "0123456789";
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto content = publish(store, text);
    EXPECT_TRUE(store.check(content));
    overwrite(store.folder(content) / "value.txt", i, 'x');
    EXPECT_FALSE(store.check(content));
    EXPECT_FALSE(fs::exists(store.folder(content)));
  }
}

TEST(Store, TruncatedRecordIsNoRecord) {
  const tests::ScratchFolder folder;
  const Store store(folder / "store");
  const Record record = record_of(store, "recipe\n", "hello");
  const fs::path file = store.root() / "records" / record.key().substr(0, 2) / record.key();
  std::ostringstream whole;
  whole << std::ifstream(file).rdbuf();
  for (std::size_t length = 0; length < whole.str().size(); length += 7) {
    std::ofstream(file, std::ios::trunc) << whole.str().substr(0, length);
    EXPECT_FALSE(store.find(record.key())) << length;
  }
  EXPECT_EQ(store.verify().size(), 1u);
}

TEST(Store, OtherFoldersAndFormatsAreRefused) {
  const tests::ScratchFolder folder;
  fs::create_directories(folder / "music");
  std::ofstream(folder / "music" / "song") << "la";
  EXPECT_THROW(Store(folder / "music"), UserError);
  fs::create_directories(folder / "old");
  std::ofstream(folder / "old" / "FORMAT") << "geocage-store 0\n";
  EXPECT_THROW(Store(folder / "old"), UserError);
}

TEST(Store, SlotsKeepWhatTheyWereMadeFrom) {
  const tests::ScratchFolder folder;
  const Store store(folder / "store");
  EXPECT_FALSE(store.slot("mug/scan"));
  store.write_slot("mug/scan", {"k", "c", "a = 1\nb = 2\n", ""});
  store.write_slot("mug/place/hand", {"k2", "c2", "new\n", "old\n"});
  EXPECT_EQ(store.slot("mug/scan")->recipe, "a = 1\nb = 2\n");
  EXPECT_EQ(store.slot("mug/scan")->previous_recipe, "");
  EXPECT_EQ(store.slot("mug/place/hand")->previous_recipe, "old\n");
  EXPECT_EQ(store.slots(), (std::vector<std::string>{"mug/place/hand", "mug/scan"}));
}

TEST(Store, GarbageIsWhatNoSlotNeeds) {
  const tests::ScratchFolder folder;
  const Store store(folder / "store");
  const Record kept = record_of(store, "kept\n", "kept"), lost = record_of(store, "lost\n", "lost");
  store.write_slot("a/b", {kept.key(), kept.content, kept.recipe, ""});
  EXPECT_EQ(store.collect_garbage(true).paths.size(), 2u);
  EXPECT_TRUE(store.find(lost.key()));
  store.collect_garbage(false);
  EXPECT_FALSE(store.find(lost.key()));
  EXPECT_TRUE(store.find(kept.key()));
  EXPECT_TRUE(store.collect_garbage(false).paths.empty());
}

}  // namespace
}  // namespace geocage::pipeline
