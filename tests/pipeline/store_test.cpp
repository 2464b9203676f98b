#include "pipeline/store.h"

#include <fstream>
#include <future>
#include <sstream>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/wait.h>
#include <unistd.h>

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

TEST(Store, WhatIsPublishedReplacesWhatIsDamaged) {
  const tests::ScratchFolder folder;
  const Store store(folder / "store");
  const auto content = publish(store, "hello");
  overwrite(store.folder(content) / "value.txt", 0, 'H');
  EXPECT_EQ(publish(store, "hello"), content);
  EXPECT_TRUE(store.check(content));
}

TEST(Store, AFolderInAnArtefactIsDamage) {
  const tests::ScratchFolder folder;
  const Store store(folder / "store");
  const auto content = publish(store, "hello");
  fs::create_directory(store.folder(content) / "notes");
  EXPECT_FALSE(store.check(content));
}

// Each of them finds it damaged, or gone because another one has put it away.
TEST(Store, ManyMayFindOneArtefactDamaged) {
  const tests::ScratchFolder folder;
  const Store store(folder / "store");
  for (int round = 0; round < 50; ++round) {
    const auto content = publish(store, "round " + std::to_string(round));
    overwrite(store.folder(content) / "value.txt", 0, 'R');
    std::vector<std::future<bool>> finders;
    for (int i = 0; i < 4; ++i)
      finders.push_back(std::async(std::launch::async, [&] { return store.check(content); }));
    for (auto& finder : finders) EXPECT_FALSE(finder.get());
  }
}

TEST(Store, ScratchOfAnotherProcessOfOneNameIsLeftAlone) {
  const tests::ScratchFolder folder;
  const Store store(folder / "store");
  const std::string first = store.scratch().filename();
  const auto number = first.rfind('-') + 1;
  const auto next =
      store.root() / "tmp" / (first.substr(0, number) + std::to_string(std::stoi(first.substr(number)) + 1));
  fs::create_directory(next);
  EXPECT_NE(store.scratch(), next);
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
  EXPECT_EQ(store.verify().faults.size(), 1u);
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

// Archives and clouds forget folders that are empty.
TEST(Store, FoldersThatAreGoneAreMadeAgain) {
  const tests::ScratchFolder folder;
  const std::string content = publish(Store(folder / "store"), "kept");
  for (const char* part : {"tmp", "records", "slots", "locks"}) fs::remove_all(folder / "store" / part);
  const Store store(folder / "store");
  EXPECT_TRUE(store.slots().empty());
  EXPECT_EQ(publish(store, "kept"), content);
  EXPECT_EQ(store.collect_garbage(false).paths.size(), 1u);
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

// Names of files end at 255 bytes; those of variants name every level.
TEST(Store, SlotsMayHaveLongNames) {
  const tests::ScratchFolder folder;
  const Store store(folder / "store");
  const std::string first = "mug@" + std::string(700, 'x') + "/remesh",
                    other = "mug@" + std::string(701, 'x') + "/remesh";
  store.write_slot(first, {"k", "c", "a = 1\n", ""});
  EXPECT_FALSE(store.slot(other));
  store.write_slot(other, {"k2", "c2", "b = 1\n", ""});
  EXPECT_EQ(store.slot(first)->key, "k");
  EXPECT_EQ(store.slots(), (std::vector<std::string>{first, other}));
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

// Two of one process are as two processes: the lock goes with the opened file.
TEST(Store, GarbageStaysWhileAnotherHasTheStoreOpen) {
  const tests::ScratchFolder folder;
  const Store store(folder / "store");
  const Record lost = record_of(store, "lost\n", "lost");
  {
    const Store other(folder / "store");
    EXPECT_THROW(store.collect_garbage(false), UserError);
    EXPECT_EQ(store.collect_garbage(true).paths.size(), 2u);
    EXPECT_TRUE(store.find(lost.key()));
  }
  EXPECT_EQ(store.collect_garbage(false).paths.size(), 2u);
  EXPECT_FALSE(store.find(lost.key()));
  const Store other(folder / "store");  // does not wait for the collector that has ended
}

TEST(Store, LocksOfSlotsAreGarbageToo) {
  const tests::ScratchFolder folder;
  const Store store(folder / "store");
  { const FileLock lock(store.root() / "locks" / "key"); }
  store.collect_garbage(false);
  EXPECT_FALSE(fs::exists(store.root() / "locks" / "key"));
}

// The worker has the file open, too: closing it here alone would leave the lock to it.
TEST(FileLock, GoesWithItsScopeThoughAWorkerLives) {
  const tests::ScratchFolder folder;
  pid_t worker = 0;
  {
    const FileLock lock(folder / "lock");
    worker = fork();
    if (worker == 0) {
      pause();
      _exit(0);
    }
  }
  const int file = open((folder / "lock").c_str(), O_RDWR | O_CLOEXEC);
  EXPECT_EQ(flock(file, LOCK_EX | LOCK_NB), 0);
  close(file);
  kill(worker, SIGKILL);
  waitpid(worker, nullptr, 0);
}

}  // namespace
}  // namespace geocage::pipeline
