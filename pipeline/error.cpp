#include "pipeline/error.h"

namespace geocage::pipeline {

namespace {
std::string line(const std::string& where, const std::string& sentence, const std::string& hint) {
  std::string text = where.empty() ? "error: " : where + ": error: ";
  text += sentence;
  if (!hint.empty()) text += " (" + hint + ")";
  return text;
}
}  // namespace

UserError::UserError(Fault fault, std::string where, std::string sentence, std::string hint)
    : std::runtime_error(line(where, sentence, hint)),
      fault_(fault),
      where_(std::move(where)),
      sentence_(std::move(sentence)),
      hint_(std::move(hint)) {}

}  // namespace geocage::pipeline
