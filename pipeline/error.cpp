#include "pipeline/error.h"

#include "pipeline/spelling.h"

namespace geocage::pipeline {

namespace {
std::string line(const std::string& where, const std::string& sentence, const std::string& hint) {
  std::string text = where.empty() ? "error: " : where + ": error: ";
  text += sentence;
  if (!hint.empty()) text += " (" + hint + ")";
  return text;
}
}  // namespace

UserError::UserError(Fault fault, const std::string& where, const std::string& sentence,
                     const std::string& hint)
    : std::runtime_error(plain_text(line(where, sentence, hint))),
      fault_(fault),
      where_(plain_text(where)),
      sentence_(plain_text(sentence)),
      hint_(plain_text(hint)) {}

}  // namespace geocage::pipeline
