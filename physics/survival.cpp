#include "physics/survival.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace geocage::physics {

std::vector<SurvivalStep> survival(std::vector<Life> lives) {
  std::ranges::sort(lives, {}, &Life::time_s);
  std::vector<SurvivalStep> curve = {{0, 1}};
  for (std::size_t i = 0; i < lives.size();) {
    const double time = lives[i].time_s;
    const auto watched = static_cast<double>(lives.size() - i);
    int escapes = 0;
    for (; i < lives.size() && lives[i].time_s == time; ++i) escapes += lives[i].escaped;
    if (escapes > 0) curve.push_back({time, curve.back().share * (1 - escapes / watched)});
  }
  return curve;
}

double mean_held_s(const std::vector<SurvivalStep>& curve, double horizon_s) {
  double sum = 0;
  for (std::size_t i = 0; i < curve.size(); ++i) {
    const double until = i + 1 < curve.size() ? std::min(curve[i + 1].time_s, horizon_s) : horizon_s;
    sum += curve[i].share * std::max(0.0, until - curve[i].time_s);
  }
  return sum;
}

double share_at(const std::vector<SurvivalStep>& curve, double time_s) {
  double share = 1;
  for (const SurvivalStep& step : curve)
    if (step.time_s <= time_s) share = step.share;
  return share;
}

namespace {

using Is = HalfAmplitude::Is;
constexpr std::pair<Is, const char*> words[] = {{Is::at, "at"}, {Is::below, "below"}, {Is::above, "above"}};

/// Pool adjacent violators: the nearest shares that never rise.
std::vector<AmplitudeShare> falling(std::vector<AmplitudeShare> shares) {
  struct Block {
    double sum, trials;
    std::size_t count;
    double mean() const { return sum / trials; }
  };
  std::vector<Block> blocks;
  for (const AmplitudeShare& one : shares) {
    blocks.push_back({one.share * one.trials, static_cast<double>(one.trials), 1});
    while (blocks.size() > 1 && blocks[blocks.size() - 2].mean() < blocks.back().mean()) {
      const Block last = blocks.back();
      blocks.pop_back();
      blocks.back().sum += last.sum, blocks.back().trials += last.trials, blocks.back().count += last.count;
    }
  }
  auto one = shares.begin();
  for (const Block& block : blocks)
    for (std::size_t i = 0; i < block.count; ++i) (one++)->share = block.mean();
  return shares;
}

}  // namespace

std::string HalfAmplitude::text() const {
  return fmt::format("{}{}{:.3g}", is == Is::at ? "" : words[static_cast<int>(is)].second,
                     is == Is::at ? "" : " ", amplitude);
}

std::optional<HalfAmplitude> half_amplitude(std::vector<AmplitudeShare> shares) {
  std::erase_if(shares, [](const AmplitudeShare& one) { return one.trials <= 0; });
  if (shares.empty()) return {};
  std::ranges::stable_sort(shares, {}, &AmplitudeShare::amplitude);
  const auto curve = falling(std::move(shares));
  const auto at = std::ranges::find_if(curve, [](const AmplitudeShare& one) { return one.share <= 0.5; });
  if (at == curve.end()) return HalfAmplitude{Is::above, curve.back().amplitude};
  if (at->share == 0.5) return HalfAmplitude{Is::at, at->amplitude};
  if (at == curve.begin()) return HalfAmplitude{Is::below, at->amplitude};
  const AmplitudeShare &easy = *(at - 1), &hard = *at;
  const double way = (easy.share - 0.5) / (easy.share - hard.share);
  return HalfAmplitude{Is::at, easy.amplitude + way * (hard.amplitude - easy.amplitude)};
}

nlohmann::json to_json(const std::optional<HalfAmplitude>& half) {
  if (!half) return {};
  return {{"is", words[static_cast<int>(half->is)].second}, {"weights", half->amplitude}};
}

std::optional<HalfAmplitude> half_amplitude_from(const nlohmann::json& entry) {
  if (entry.is_null()) return {};
  HalfAmplitude half{Is::at, entry.at("weights")};
  for (const auto& [is, word] : words)
    if (entry.at("is") == word) half.is = is;
  return half;
}

}  // namespace geocage::physics
