#pragma once
#include <stdexcept>
#include <string>

namespace geocage::pipeline {

/// Who has to act; the value is the program's exit code.
enum class Fault { configuration = 2, input = 3, geometry = 4, store = 5 };

/// A mistake that the user can mend: where (file, element), one sentence, and a hint what to do; they may
/// quote foreign files, and are kept as plain text.
class UserError : public std::runtime_error {
 public:
  UserError(Fault fault, const std::string& where, const std::string& sentence, const std::string& hint = {});

  Fault fault() const { return fault_; }
  const std::string& where() const { return where_; }
  const std::string& sentence() const { return sentence_; }
  const std::string& hint() const { return hint_; }

 private:
  Fault fault_;
  std::string where_, sentence_, hint_;
};

}  // namespace geocage::pipeline
