// Tables with things on them that touch, seen by the virtual Kinect at 0.8 m: one object a thing, whatever
// its shape. The scan knows which thing each point lies on; that is the oracle.
#include "tests/stages/import/table_scenes.h"

#include <set>

#include <gtest/gtest.h>

#include "stages/import/import.h"
#include "tests/pipeline/scratch_folder.h"
#include "tests/stages/import/label_match.h"

namespace geocage::stages {
namespace {

// Mugs stay whole and what touches them is parted. 35 degrees: a Kinect on a low tripod. All sets and both
// heights: table_study.
TEST(TableScenes, GiveAnObjectAThing) {
  const tests::ScratchFolder folder;
  const std::set<std::string> held = {"a mug", "mug and box touch", "a can on a box", "ring",
                                      "a ball at a can"};
  for (const auto& scene : tests::table_scenes("tuning", {})) {
    if (!held.contains(scene.name)) continue;
    tests::write_seen(scene, {35}, folder / "scene.pcd");
    pipeline::Run run;
    const auto found = find_scene({.scene = "table", .cluster_by = "shape"}, run, {folder / "scene.pcd"});
    const auto match = tests::match_labels(found, 300);
    EXPECT_TRUE(match.one_each()) << scene.name << ": " << match.labelled << " things gave " << match.objects
                                  << " objects";
  }
}

// Floor, walls and a chair in view, the table against a wall: nothing of them becomes an object.
TEST(TableScenes, InARoomGiveAnObjectAThing) {
  const tests::ScratchFolder folder;
  const auto scenes = tests::table_scenes("rooms_trial", {}, {0, 4});
  ASSERT_FALSE(scenes.empty());
  tests::write_seen(scenes.front(), scenes.front().views.front(), folder / "scene.pcd");
  pipeline::Run run;
  const auto match = tests::match_labels(find_scene({}, run, {folder / "scene.pcd"}), 300);
  EXPECT_TRUE(match.one_each()) << match.labelled << " things gave " << match.objects << " objects";
  EXPECT_EQ(run.metrics().at("room"), 1);
}

}  // namespace
}  // namespace geocage::stages
