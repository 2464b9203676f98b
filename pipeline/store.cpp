#include "pipeline/store.h"

#include <atomic>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <fstream>
#include <set>
#include <sstream>
#include <system_error>
#include <thread>

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/file.h>
#include <unistd.h>

#include "pipeline/digest.h"
#include "pipeline/error.h"
#include "pipeline/who_and_when.h"

namespace geocage::pipeline {

namespace fs = std::filesystem;

namespace {

constexpr const char* format_line = "geocage-store 1\n";
constexpr const char* parts[] = {"tmp", "records", "artefacts", "slots", "locks"};
constexpr const char* lock_of_all = "open";  ///< in locks/, held by whoever has the store open

[[noreturn]] void throw_errno(const fs::path& path) {
  throw std::system_error(errno, std::generic_category(), path.string());
}

/// No other process of this host, and no other call, has it.
std::string name_of_its_own() {
  static std::atomic<int> count{0};
  return fmt::format("{}-{}-{}", host_name(), getpid(), count++);
}

void sync(const fs::path& path, int flags) {
  const int file = open(path.c_str(), flags | O_CLOEXEC);
  if (file < 0) throw_errno(path);
  const int answer = fsync(file);
  close(file);
  if (answer != 0 && errno != EINVAL) throw_errno(path);  // EINVAL: a file system without fsync
}
void sync_folder(const fs::path& folder) {
  sync(folder, O_RDONLY | O_DIRECTORY);
}

std::optional<std::string> read_text(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) return {};
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

/// Whole or not at all: written beside, synced, renamed.
void write_atomically(const fs::path& beside, const fs::path& file, const std::string& text) {
  std::ofstream out(beside, std::ios::binary);
  out << text;
  out.close();
  if (!out) throw_errno(beside);
  sync(beside, O_RDONLY);
  fs::create_directories(file.parent_path());
  fs::rename(beside, file);
  sync_folder(file.parent_path());
}

/// Nothing for a folder that goes while it is looked at.
std::optional<std::string> digest_of(const fs::path& folder) {
  try {
    return sha256_of(sha256_listing(folder));
  } catch (const std::system_error& error) {
    if (error.code() != std::errc::no_such_file_or_directory) throw;
    return {};
  }
}

std::string number_text(double x) {
  char text[40];
  return {text, std::to_chars(text, text + sizeof text, x).ptr};
}

std::string to_text(const Record& r) {
  std::string text = "geocage-record 1\ncontent " + r.content + "\n";
  for (const auto& [name, value] : r.metrics) text += "metric " + name + " = " + number_text(value) + "\n";
  text += "seconds " + number_text(r.seconds) + "\npeak_memory_gib " + number_text(r.peak_memory_gib) +
          "\nmade_at " + r.made_at + "\nhost " + r.host + "\nprogram " + r.program + "\n\n" + r.recipe;
  return text + "end\n";
}

/// Nothing for a text that isn't whole.
std::optional<Record> record_of(const std::string& text) {
  const auto body = text.find("\n\n");
  if (!text.starts_with("geocage-record 1\n") || !text.ends_with("\nend\n") || body == std::string::npos)
    return {};
  Record r;
  r.recipe = text.substr(body + 2, text.size() - body - 2 - 4);
  std::istringstream head(text.substr(0, body + 1));
  for (std::string word, line; head >> word && std::getline(head >> std::ws, line);) {
    if (word == "content") r.content = line;
    if (word == "seconds") r.seconds = std::stod(line);
    if (word == "peak_memory_gib") r.peak_memory_gib = std::stod(line);
    if (word == "made_at") r.made_at = line;
    if (word == "host") r.host = line;
    if (word == "program") r.program = line;
    if (const auto equals = line.find(" = "); word == "metric" && equals != std::string::npos)
      r.metrics[line.substr(0, equals)] = std::stod(line.substr(equals + 3));
  }
  return r;
}

std::vector<fs::path> grandchildren(const fs::path& folder) {
  std::vector<fs::path> found;
  if (!fs::exists(folder)) return found;
  for (const auto& shelf : fs::directory_iterator(folder))
    for (const auto& entry : fs::directory_iterator(shelf)) found.push_back(entry.path());
  return found;
}

/// The names of variants are free, those of folders are not: longer parts of a slot's name go on in a folder.
constexpr std::size_t longest_part = 200;
constexpr std::string_view goes_on = "~+/";
std::string folded(const std::string& slot) {
  std::string path;
  std::size_t part = 0;
  for (char c : slot) {
    part = c == '/' ? 0 : part + 1;
    if (part > longest_part) {
      path += goes_on;
      part = 1;
    }
    path += c;
  }
  return path;
}
std::string unfolded(std::string path) {
  for (std::size_t at = 0; (at = path.find(goes_on, at)) != std::string::npos;)
    path.erase(at, goes_on.size());
  return path;
}

std::uintmax_t bytes_in(const fs::path& path) {
  if (fs::is_regular_file(path)) return fs::file_size(path);
  std::uintmax_t bytes = 0;
  for (const auto& entry : fs::recursive_directory_iterator(path))
    if (entry.is_regular_file()) bytes += entry.file_size();
  return bytes;
}

}  // namespace

std::string Record::key() const {
  return sha256_of(recipe);
}

bool Store::stands_at(const fs::path& root) {
  if (const auto text = read_text(root / "FORMAT")) {
    if (*text == format_line) return true;
    throw UserError(
        Fault::store, root.string(),
        "this store has the format '" + text->substr(0, text->find('\n')).substr(0, 40) + "', not 1",
        "give another folder by --store");
  }
  std::error_code error;
  const bool taken = fs::exists(root, error) && (!fs::is_directory(root) || !fs::is_empty(root));
  if (error) throw std::system_error(error, root.string());
  const bool half_made = taken && fs::is_directory(root) && fs::exists(root / "tmp");
  if (taken && !half_made)
    throw UserError(Fault::store, root.string(),
                    "this is not a geocage store, and not an empty folder either",
                    "give another folder by --store");
  return false;
}

Store::Store(fs::path root) : root_(std::move(root)) {
  if (stands_at(root_)) {
    std::error_code ignored;  // a copy may have lost its empty folders, and may be one to read only
    for (const char* part : parts) fs::create_directories(root_ / part, ignored);
    open_ = std::make_shared<FileLock>(root_ / "locks" / lock_of_all, FileLock::Holders::many);
    return;
  }
  for (const char* part : parts) fs::create_directories(root_ / part);
  const fs::path desk = scratch();
  write_atomically(desk / "FORMAT", root_ / "FORMAT", format_line);
  fs::remove(desk);
  open_ = std::make_shared<FileLock>(root_ / "locks" / lock_of_all, FileLock::Holders::many);
}

fs::path Store::folder(const std::string& content) const {
  return root_ / "artefacts" / content.substr(0, 2) / content;
}
fs::path Store::record_file(const std::string& key) const {
  return root_ / "records" / key.substr(0, 2) / key;
}
fs::path Store::slot_file(const std::string& name) const {
  return root_ / "slots" / (folded(name) + ".slot");
}

std::optional<Record> Store::find(const std::string& key) const {
  const auto text = read_text(record_file(key));
  if (!text) return {};
  auto record = record_of(*text);
  if (!record || record->key() != key || !fs::exists(folder(record->content))) return {};
  return record;
}

bool Store::check(const std::string& content) const {
  const fs::path at = folder(content);
  if (!fs::exists(at)) return false;
  if (digest_of(at) == content) return true;
  const fs::path cell = root_ / "quarantine";
  std::error_code error;
  fs::create_directories(cell, error);
  if (!error) fs::rename(at, cell / (content + "-" + name_of_its_own()), error);
  const bool stays =  // or another process was faster
      error == std::errc::read_only_file_system || error == std::errc::permission_denied ||
      error == std::errc::no_such_file_or_directory;
  if (error && !stays) throw std::system_error(error, at.string());
  return false;
}

fs::path Store::scratch() const {
  fs::create_directories(root_ / "tmp");
  for (;;) {  // a process of another container may have the same host's name and the same number
    fs::path folder = root_ / "tmp" / name_of_its_own();
    if (fs::create_directory(folder)) return folder;
  }
}

std::string Store::publish(const fs::path& scratch_folder) const {
  std::string content = sha256_of(sha256_listing(scratch_folder));
  for (const auto& entry : fs::directory_iterator(scratch_folder)) {
    sync(entry.path(), O_RDONLY);
    fs::permissions(entry.path(), fs::perms::owner_read | fs::perms::group_read | fs::perms::others_read);
  }
  sync_folder(scratch_folder);
  const fs::path at = folder(content);
  fs::create_directories(at.parent_path());
  std::error_code error;
  fs::rename(scratch_folder, at, error);
  const bool taken = error == std::errc::directory_not_empty || error == std::errc::file_exists;
  if (taken && check(content))
    fs::remove_all(scratch_folder);  // the same content is there already
  else if (taken)
    fs::rename(scratch_folder, at);  // what was there is damaged and in quarantine now
  else if (error)
    throw std::system_error(error, at.string());
  sync_folder(at.parent_path());
  return content;
}

void Store::write(const Record& record) const {
  const fs::path desk = scratch();
  write_atomically(desk / "record", record_file(record.key()), to_text(record));
  fs::remove(desk);
}

std::optional<SlotNote> Store::slot(const std::string& name) const {
  const auto text = read_text(slot_file(name));
  const auto middle = text ? text->find("\nbefore\n") : std::string::npos;
  if (middle == std::string::npos || !text->ends_with("end\n")) return {};
  SlotNote note;
  std::istringstream head(*text);
  std::getline(head, note.key);
  std::getline(head, note.content);
  const auto recipe = static_cast<std::size_t>(head.tellg());
  note.recipe = text->substr(recipe, middle + 1 - recipe);
  note.previous_recipe = text->substr(middle + 8, text->size() - middle - 8 - 4);
  return note;
}

void Store::write_slot(const std::string& name, const SlotNote& note) const {
  const fs::path desk = scratch();
  write_atomically(
      desk / "slot", slot_file(name),
      note.key + "\n" + note.content + "\n" + note.recipe + "before\n" + note.previous_recipe + "end\n");
  fs::remove(desk);
}

std::vector<std::string> Store::slots() const {
  std::set<std::string> names;
  for (const auto& entry : fs::recursive_directory_iterator(root_ / "slots"))
    if (entry.path().extension() == ".slot")
      names.insert(unfolded(entry.path().lexically_relative(root_ / "slots").replace_extension().string()));
  return {names.begin(), names.end()};
}

Store::Verdict Store::verify() const {
  Verdict verdict;
  auto& faults = verdict.faults;
  for (const auto& file : grandchildren(root_ / "records")) {
    const auto record = record_of(read_text(file).value_or(""));
    if (!record || record->key() != file.filename())
      faults.push_back(file.string() + ": the record is damaged; it will be made anew");
    else if (!fs::exists(folder(record->content)))
      faults.push_back(file.string() + ": its artefact is missing; it will be made anew");
  }
  for (const auto& artefact : grandchildren(root_ / "artefacts")) {
    ++verdict.artefacts;
    if (!check(artefact.filename()))
      faults.push_back(artefact.string() + ": its files do not have the digest that names them; " +
                       (fs::exists(artefact) ? "it can't be quarantined here" : "quarantined"));
  }
  return verdict;
}

std::vector<fs::path> Store::stale_scratch() const {
  std::vector<fs::path> stale;
  const std::string mine = host_name() + "-";
  for (const auto& entry : fs::directory_iterator(root_ / "tmp")) {
    const std::string name = entry.path().filename();
    const auto last = name.rfind('-');
    const auto before = last == std::string::npos ? last : name.rfind('-', last - 1);
    if (before == std::string::npos || name.substr(0, before + 1) != mine) continue;
    const int process = std::atoi(name.substr(before + 1, last - before - 1).c_str());
    if (process > 0 && kill(process, 0) != 0 && errno == ESRCH) stale.push_back(entry.path());
  }
  return stale;
}

void Store::sweep_scratch() const {
  for (const auto& path : stale_scratch()) {
    std::error_code ignored;  // another process may sweep the same folder
    fs::remove_all(path, ignored);
  }
}

Store::Garbage Store::collect_garbage(bool dry_run) const {
  if (!dry_run && !open_->alone_within(2))
    throw UserError(Fault::store, root_.string(),
                    "another geocage works with this store, and may need what no slot names yet",
                    "collect garbage when it has ended, or look with --dry-run");
  std::set<std::string> keys, contents;
  for (const auto& name : slots())
    if (const auto note = slot(name)) {
      keys.insert(note->key);
      contents.insert(note->content);
    }
  Garbage garbage;
  garbage.paths = stale_scratch();
  for (const auto& record : grandchildren(root_ / "records"))
    if (!keys.contains(record.filename())) garbage.paths.push_back(record);
  for (const auto& artefact : grandchildren(root_ / "artefacts"))
    if (!contents.contains(artefact.filename())) garbage.paths.push_back(artefact);
  if (fs::exists(root_ / "quarantine"))
    for (const auto& entry : fs::directory_iterator(root_ / "quarantine"))
      garbage.paths.push_back(entry.path());
  for (const auto& path : garbage.paths) garbage.bytes += bytes_in(path);
  if (dry_run) return garbage;
  for (const auto& path : garbage.paths) fs::remove_all(path);
  for (const auto& lock : fs::directory_iterator(root_ / "locks"))
    if (lock.path().filename() != lock_of_all) fs::remove(lock.path());  // nobody else is here to hold one
  open_->share();
  return garbage;
}

FileLock::FileLock(const fs::path& file, Holders holders)
    : file_(open(file.c_str(), (holders == Holders::one ? O_RDWR : O_RDONLY) | O_CREAT | O_CLOEXEC, 0644)) {
  const bool many = holders == Holders::many;
  if (file_ < 0 && many && (errno == EROFS || errno == EACCES || errno == ENOENT)) return;
  if (file_ < 0) throw_errno(file);
  while (flock(file_, many ? LOCK_SH : LOCK_EX) != 0)
    if (errno != EINTR) throw_errno(file);
}
FileLock::~FileLock() {
  if (file_ < 0) return;
  flock(file_, LOCK_UN);  // closing is not enough: workers that were forked meanwhile have it open
  close(file_);
}

bool FileLock::alone_within(double seconds) const {
  using Clock = std::chrono::steady_clock;
  const auto until = Clock::now() + std::chrono::duration<double>(seconds);
  if (file_ < 0) return true;
  flock(file_, LOCK_UN);  // of two that wait for each other one gets it
  while (flock(file_, LOCK_EX | LOCK_NB) != 0) {
    if (Clock::now() > until) {
      share();
      return false;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return true;
}
void FileLock::share() const {
  while (file_ >= 0 && flock(file_, LOCK_SH) != 0 && errno == EINTR) {
  }
}

}  // namespace geocage::pipeline
