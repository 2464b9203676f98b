#pragma once

namespace geocage::reports {

/// A share and the interval that holds the true one.
struct Proportion {
  double share = 0, low = 0, high = 1;
};

/// Wilson's score interval (Wilson 1927) of `hits` among `trials`; z = 1.959964 gives 95 %. No trials: 0 and
/// [0, 1]. It takes the trials as independent, which grasps of one object are not.
Proportion wilson(int hits, int trials, double z = 1.959963984540054);

/// McNemar's exact two-sided test (1947): how likely `gained` against `lost` pairs, or a more uneven split,
/// is where both are as likely, p = min(1, 2 sum over k <= min of C(n, k) / 2^n). No pair that differs: 1. It
/// takes the pairs as independent, which those of one object are not.
double mcnemar(int gained, int lost);

}  // namespace geocage::reports
