#pragma once

namespace geocage::reports {

/// A share and the interval that holds the true one.
struct Proportion {
  double share = 0, low = 0, high = 1;
};

/// Wilson's score interval (Wilson 1927) of `hits` among `trials`; z = 1.959964 gives 95 %. No trials: 0 and
/// [0, 1]. It takes the trials as independent, which grasps of one object are not.
Proportion wilson(int hits, int trials, double z = 1.959963984540054);

}  // namespace geocage::reports
