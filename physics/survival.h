#pragma once
#include <vector>

namespace geocage::physics {

/// A watched life: how long, and whether it ended by escape or was still going on (censored).
struct Life {
  double time_s = 0;
  bool escaped = false;
};

/// The share that survives beyond `time_s`, from there until the next step.
struct SurvivalStep {
  double time_s = 0, share = 1;
};

/// Kaplan and Meier (1958): S(t) = prod over escapes at t_i <= t of (1 - d_i / n_i), n_i still watched at
/// t_i. Starts with {0, 1}; one step an escape time.
std::vector<SurvivalStep> survival(std::vector<Life> lives);
/// Integral of S from 0 to the horizon: the mean time held, of at most `horizon_s`.
double mean_held_s(const std::vector<SurvivalStep>& curve, double horizon_s);
/// S at `time_s`.
double share_at(const std::vector<SurvivalStep>& curve, double time_s);

}  // namespace geocage::physics
