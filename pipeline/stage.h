#pragma once
#include "pipeline/codec.h"
#include "pipeline/fields.h"
#include "pipeline/run.h"

namespace geocage::pipeline {

/// A stage: a pure function with a name and a version. Raise the version when it would answer differently.
///   inline constexpr pipeline::Stage remesh_stage{"remesh", 3, &remesh};
template <class Out, class Params, class... In>
struct Stage {
  const char* name;
  int version;
  Out (*make)(const Params&, Run&, const In&...);
  /// What it takes at most on usual input (docs/measurements/sweeps.md); so many run at once as the machine
  /// holds.
  double memory_gib = 0.25;
};

template <class Out, class Params, class... In>
Stage(const char*, int, Out (*)(const Params&, Run&, const In&...)) -> Stage<Out, Params, In...>;
template <class Out, class Params, class... In>
Stage(const char*, int, Out (*)(const Params&, Run&, const In&...), double) -> Stage<Out, Params, In...>;

}  // namespace geocage::pipeline
