#pragma once
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

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

/// Share still held under random wrenches of one amplitude (in weights), over so many trials.
struct AmplitudeShare {
  double amplitude = 0, share = 1;
  int trials = 0;
};
/// a_50: the amplitude at which half is still held. Where all tested amplitudes hold less, or more, than half
/// it is only known to be below the smallest, or above the largest one (censored).
struct HalfAmplitude {
  enum class Is { at, below, above } is = Is::at;
  double amplitude = 0;

  std::string text() const;  ///< "1.41", "below 0.5", "above 5"
};
/// Shares that rise with the amplitude, which chance alone does, are first pooled (isotonic regression, each
/// weighed by its trials; Ayer et al. 1955); then the first crossing of one half is interpolated linearly
/// between neighbouring amplitudes. Nothing without shares.
std::optional<HalfAmplitude> half_amplitude(std::vector<AmplitudeShare> shares);

/// {"is": "at", "below" or "above", "weights": a}; null for nothing.
nlohmann::json to_json(const std::optional<HalfAmplitude>& half);
std::optional<HalfAmplitude> half_amplitude_from(const nlohmann::json& entry);

}  // namespace geocage::physics
