#pragma once

namespace geocage::geometry {

/// For tests of code that is compiled once for each instruction set (docs/decisions/0007-highway.md): those
/// that this machine has, and the one to use from now on ("" for the best).
int instruction_sets(const char** names, int most);
void force_instruction_set(const char* name);

}  // namespace geocage::geometry
