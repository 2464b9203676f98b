#pragma once

namespace geocage::tests {

/// False where a sanitizer has its own malloc: nothing is counted then.
bool allocations_are_counted();
/// Calls of malloc so far.
long allocations();

}  // namespace geocage::tests
