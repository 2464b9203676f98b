#include "cli/parameters.h"

#include <algorithm>
#include <set>
#include <type_traits>
#include <utility>

#include <gtest/gtest.h>

namespace geocage::cli {
namespace {

/// Converts to anything: how many of them an aggregate takes is how many members it has.
struct Anything {
  template <class T>
  operator T() const;  // NOLINT: never defined, never called
};

template <class T, std::size_t... I>
constexpr bool takes(std::index_sequence<I...>) {
  return requires {
    T{(static_cast<void>(I), Anything{})...};
  };
}

template <class T, std::size_t N = 64>
constexpr std::size_t members() {
  if constexpr (N == 0)
    return 0;
  else if constexpr (takes<T>(std::make_index_sequence<N>{}))
    return N;
  else
    return members<T, N - 1>();
}

struct Three {
  int a;
  double b;
  std::string c;
};
static_assert(members<Three>() == 3);

// A member that visit forgets would be missing from recipes: the store would answer with stale results.
TEST(Parameters, VisitNamesEveryMember) {
  StageParameters parameters;
  for_each_stage(parameters, [](const char* stage, int, const char*, auto& params) {
    constexpr std::size_t count = members<std::remove_reference_t<decltype(params)>>();
    const auto fields = pipeline::fields_of(params);
    EXPECT_EQ(fields.list().size(), count) << stage;
  });
}

TEST(Parameters, NamesAreUniqueAndExplained) {
  for (const auto& stage : stage_names()) {
    StageParameters parameters;
    std::set<std::string> names;
    const auto fields = fields_of_stage(parameters, stage);
    for (const auto& field : fields.list()) {
      EXPECT_TRUE(names.insert(field.name).second) << stage << "." << field.name;
      EXPECT_FALSE(field.help.empty()) << stage << "." << field.name;
    }
  }
}

TEST(Parameters, ConditionsNameFieldsAndTheirChoices) {
  for (const auto& stage : stage_names()) {
    StageParameters parameters;
    const auto fields = fields_of_stage(parameters, stage);
    for (const auto& field : fields.list()) {
      if (field.with.empty()) continue;
      const auto with = std::ranges::find(fields.list(), field.with, &pipeline::Field::name);
      ASSERT_NE(with, fields.list().end()) << stage << "." << field.name;
      for (const auto& value : field.with_values)
        EXPECT_EQ(std::ranges::count(with->choices, value), 1) << stage << "." << field.name << ": " << value;
    }
  }
}

TEST(Parameters, DefaultsAreInsideTheirRanges) {
  for (const auto& stage : stage_names()) {
    StageParameters parameters;
    const auto fields = fields_of_stage(parameters, stage);
    for (const auto& field : fields.list()) {
      std::vector<double> values;
      if (const auto* x = std::get_if<double*>(&field.value)) values = {**x};
      if (const auto* x = std::get_if<int*>(&field.value)) values = {static_cast<double>(**x)};
      if (const auto* x = std::get_if<std::vector<double>*>(&field.value)) values = **x;
      for (double value : values) {
        EXPECT_GE(value, field.range.low) << stage << "." << field.name;
        EXPECT_LE(value, field.range.high) << stage << "." << field.name;
      }
    }
  }
}

}  // namespace
}  // namespace geocage::cli
