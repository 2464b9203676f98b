#pragma once
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace geocage::pipeline {

/// What the store knows of one made artefact. `recipe`, `content` and `metrics` are the same wherever it is
/// made; the rest tells who made it when.
struct Record {
  std::string recipe, content;
  std::map<std::string, double> metrics;
  double seconds = 0;
  double peak_memory_gib = 0;  ///< of the worker; 0: not known
  std::string made_at, host, program;

  std::string key() const;  ///< SHA-256 of the recipe
};

/// What a slot was last made from, and what it was made from before that.
struct SlotNote {
  std::string key, content, recipe, previous_recipe;
};

/// Holds the lock of a file, made when it isn't there, while it lives; waits until it has it. The kernel lets
/// go of it when the process dies, however it dies; a worker that was forked meanwhile keeps no part of it.
class FileLock {
 public:
  enum class Holders { one, many };
  /// For `many` holders the file may be one that can't be written, and without any file there is no lock.
  explicit FileLock(const std::filesystem::path& file, Holders holders = Holders::one);
  ~FileLock();
  FileLock(const FileLock&) = delete;
  FileLock& operator=(const FileLock&) = delete;

  /// Whether it becomes the only holder within `seconds`; then it is, until share() or its end.
  bool alone_within(double seconds) const;
  void share() const;

 private:
  int file_ = -1;
};

/// A content-addressed store of artefacts (docs/store.md). Publishing is one rename of a finished folder;
/// locks only save double work, so any number of processes may share a store. While one is open, no other
/// process collects its garbage. Trouble with the disk is a std::system_error that names the path.
class Store {
 public:
  /// Opens or makes the store at `root`. UserError (store) when the folder is something else or another
  /// format.
  explicit Store(std::filesystem::path root);
  /// Whether there is a store at `root`; makes nothing. UserError as the constructor.
  static bool stands_at(const std::filesystem::path& root);

  const std::filesystem::path& root() const { return root_; }
  std::filesystem::path folder(const std::string& content) const;

  /// The record of a key whose artefact is there; nothing when either is missing or the record is unreadable.
  std::optional<Record> find(const std::string& key) const;
  /// True when the artefact's files still have the digest that names them. A mismatch moves the entry to
  /// `quarantine/`, unless the store is one to read only, and answers false.
  bool check(const std::string& content) const;

  /// An empty folder on the store's file system to write an artefact into.
  std::filesystem::path scratch() const;
  /// Moves a finished scratch folder to its place and answers its content. Files become read-only; everything
  /// is synced before the rename. Publishing the same content twice is fine.
  std::string publish(const std::filesystem::path& scratch_folder) const;
  void write(const Record& record) const;

  std::optional<SlotNote> slot(const std::string& name) const;
  void write_slot(const std::string& name, const SlotNote& note) const;
  std::vector<std::string> slots() const;

  struct Verdict {
    std::size_t artefacts = 0;        ///< looked at
    std::vector<std::string> faults;  ///< a sentence each
  };
  /// Looks at every record and artefact. Quarantines damaged artefacts.
  Verdict verify() const;

  struct Garbage {
    std::vector<std::filesystem::path> paths;
    std::uintmax_t bytes = 0;
  };
  /// What no slot needs; removed unless `dry_run`. UserError (store) while another process has the store
  /// open: it may have made what no slot names yet.
  Garbage collect_garbage(bool dry_run) const;
  /// Removes scratch folders of processes of this host that are gone.
  void sweep_scratch() const;

 private:
  std::filesystem::path record_file(const std::string& key) const;
  std::filesystem::path slot_file(const std::string& name) const;
  std::vector<std::filesystem::path> stale_scratch() const;
  std::filesystem::path root_;
  std::shared_ptr<FileLock> open_;  ///< of many holders
};

}  // namespace geocage::pipeline
