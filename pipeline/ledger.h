#pragma once
#include <optional>
#include <string>
#include <vector>

#include "pipeline/store.h"

namespace geocage::pipeline {

/// What the ledger says of a slot that could not be made.
struct Failure {
  std::string slot, stage;
  std::string code;      ///< input, geometry, configuration, crash, timeout, out_of_memory or exception
  std::string sentence;  ///< one line
  std::string key;       ///< SHA-256 of the recipe that failed
  std::string program;   ///< digest of the program that tried
  std::string inputs;    ///< digests of the inputs, with spaces between
  std::string command;   ///< does it again
};

/// Failures of a store, a small file each in `failures/`. A slot that is made at last leaves the ledger.
/// Losing an entry costs one more try and nothing else, so entries are renamed into place but not synced.
class Ledger {
 public:
  explicit Ledger(const Store& store) : root_(store.root() / "failures") {}
  std::optional<Failure> find(const std::string& slot) const;
  std::vector<Failure> all() const;  ///< by slot
  void write(const Failure& failure) const;
  void forget(const std::string& slot) const;

 private:
  std::filesystem::path root_;
};

}  // namespace geocage::pipeline
