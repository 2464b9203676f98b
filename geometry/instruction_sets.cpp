#include "geometry/instruction_sets.h"

#include <cstdint>
#include <cstring>

#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL)  // as in the files that are compiled for several
#include <hwy/highway.h>

namespace geocage::geometry {

int instruction_sets(const char** names, int most) {
  int count = 0;
  hwy::SetSupportedTargetsForTest(0);
  for (std::int64_t left = hwy::SupportedTargets() & HWY_TARGETS; left != 0 && count < most; left &= left - 1)
    names[count++] = hwy::TargetName(left & -left);
  return count;
}

void force_instruction_set(const char* name) {
  hwy::SetSupportedTargetsForTest(0);
  for (std::int64_t left = hwy::SupportedTargets() & HWY_TARGETS; left != 0; left &= left - 1)
    if (std::strcmp(name, hwy::TargetName(left & -left)) == 0) {
      hwy::SetSupportedTargetsForTest(left & -left);
      break;
    }
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

}  // namespace geocage::geometry
