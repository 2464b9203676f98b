#include <gtest/gtest.h>

#include "hands/kinematics.h"
#include "pipeline/error.h"

// urdfdom's links hold each other by shared pointers: a cyclic model, which it refuses itself, is never
// freed.
extern "C" const char* __lsan_default_suppressions() {
  return "leak:liburdfdom_model";
}

namespace geocage::hands {
namespace {

std::string robot(const std::string& body) {
  return "<robot name='r'>" + body + "</robot>";
}
std::string links(std::initializer_list<const char*> names) {
  std::string text;
  for (const std::string name : names) text += "<link name='" + name + "'/>";
  return text;
}
std::string joint(
    const std::string& name, const std::string& parent, const std::string& child,
    const std::string& rest = "<axis xyz='0 0 1'/><limit lower='-1' upper='1' velocity='2' effort='3'/>",
    const std::string& type = "revolute") {
  return "<joint name='" + name + "' type='" + type + "'><parent link='" + parent + "'/><child link='" +
         child + "'/>" + rest + "</joint>";
}
std::string limits(const std::string& lower, const std::string& upper, const std::string& rest = "") {
  return "<axis xyz='0 0 1'/><limit lower='" + lower + "' upper='" + upper + "' velocity='2' effort='3'/>" +
         rest;
}
std::string mimic(const std::string& master, const std::string& multiplier = "1",
                  const std::string& offset = "0") {
  return limits("-1", "1",
                "<mimic joint='" + master + "' multiplier='" + multiplier + "' offset='" + offset + "'/>");
}

/// The sentence that refuses `text` must hold all `words`.
void expect_refusal(const std::string& text, std::initializer_list<const char*> words) {
  try {
    parse_urdf(text, "test.urdf");
    ADD_FAILURE() << "was accepted: " << text;
  } catch (const pipeline::UserError& error) {
    EXPECT_EQ(error.fault(), pipeline::Fault::configuration);
    EXPECT_EQ(error.where(), "test.urdf");
    for (const std::string word : words)
      EXPECT_NE(std::string(error.what()).find(word), std::string::npos)
          << word << " is not in: " << error.what();
  }
}

TEST(Urdf, RefusesWhatIsNoUrdf) {
  expect_refusal("", {"not a valid URDF"});
  expect_refusal("<robot", {"not a valid URDF"});
  expect_refusal("\x7f\x45\x4c\x46 random bytes", {"not a valid URDF"});
  expect_refusal(robot(""), {"not a valid URDF"});
  EXPECT_THROW(read_urdf("/no/such/file.urdf"), pipeline::UserError);
}

TEST(Urdf, RefusesLinksThatDoNotFormATree) {
  expect_refusal(robot(links({"a", "b"}) + joint("j", "a", "c")), {"c"});
  expect_refusal(robot(links({"a", "b"}) + joint("j", "a", "b") + joint("k", "b", "a")),
                 {"not a valid URDF", "tree"});
  expect_refusal(robot(links({"a", "b", "c"}) + joint("j", "b", "c") + joint("k", "c", "b")),
                 {"'b'", "cycle"});
  expect_refusal(
      robot(links({"a", "b", "c"}) + joint("j", "a", "b") + joint("k", "a", "c") + joint("l", "b", "c")),
      {"'c'", "cycle"});
}

TEST(Urdf, RefusesNamesTwiceAndRootsTwice) {
  expect_refusal(robot(links({"a", "b", "b"}) + joint("j", "a", "b")), {"b", "not unique"});
  expect_refusal(robot(links({"a", "b", "c"}) + joint("j", "a", "b") + joint("j", "b", "c")),
                 {"j", "not unique"});
  expect_refusal(robot(links({"a", "b"})), {"not a valid URDF", "root"});
  expect_refusal(robot(links({"a", "b", "c", "d"}) + joint("j", "a", "b") + joint("k", "c", "d")),
                 {"not a valid URDF", "root"});
}

TEST(Urdf, RefusesImpossibleJointsByName) {
  const auto one = [](const std::string& rest, const std::string& type = "revolute") {
    return robot(links({"a", "b"}) + joint("bend", "a", "b", rest, type));
  };
  expect_refusal(one(limits("1", "-1")), {"'bend'", "lower limit is above"});
  expect_refusal(one(limits("nan", "1")), {"bend"});
  expect_refusal(one(limits("-1", "inf")), {"bend"});
  expect_refusal(one("<axis xyz='0 0 0'/><limit lower='0' upper='1' velocity='1' effort='1'/>"),
                 {"'bend'", "axis"});
  expect_refusal(one("<origin xyz='1000 0 0'/>" + limits("0", "1")), {"'bend'", "10 m"});
  expect_refusal(one("<axis xyz='0 0 1'/>"), {"bend"});
  expect_refusal(one("<axis xyz='0 0 1'/>", "prismatic"), {"bend"});
  expect_refusal(one("<origin xyz='nan 0 0'/>" + limits("0", "1")), {"bend"});
  expect_refusal(one("<origin xyz='0 0 0' rpy='0 inf 0'/>" + limits("0", "1")), {"bend"});
  expect_refusal(one(limits("0", "1"), "hinge"), {"bend"});
  expect_refusal(one("", "floating"), {"'bend'", "floating"});
  expect_refusal(one("", "planar"), {"'bend'", "planar"});
}

TEST(Urdf, RefusesImpossibleMimicsByName) {
  const auto two = [](const std::string& rest) {
    return robot(links({"a", "b", "c"}) + joint("bend", "a", "b") + joint("follow", "b", "c", rest));
  };
  expect_refusal(two(mimic("follow")), {"'follow'", "itself"});
  expect_refusal(two(mimic("band")), {"'follow'", "'band'", "nearest name is 'bend'"});
  expect_refusal(two(mimic("bend", "0")), {"'follow'", "zero"});
  expect_refusal(two(mimic("bend", "1e999")), {"follow"});
  expect_refusal(two(mimic("bend", "1", "7")), {"'follow'", "no value within the limits"});
  expect_refusal(
      robot(links({"a", "b", "c"}) + joint("x", "a", "b", mimic("y")) + joint("y", "b", "c", mimic("x"))),
      {"circle"});
}

TEST(Urdf, RefusesAbsurdMeshScales) {
  for (const char* scale : {"0 1 1", "1e9 1e9 1e9", "nan 1 1"})
    expect_refusal(robot("<link name='a'><collision><geometry><mesh filename='package://x/a.stl' scale='" +
                         std::string(scale) + "'/></geometry></collision></link>"),
                   {"a"});
  EXPECT_NO_THROW(parse_urdf(robot("<link name='a'><visual><geometry><mesh filename='package://x/a.stl' "
                                   "scale='0.001 0.001 0.001'/></geometry></visual></link>"),
                             "test.urdf"));
}

TEST(Urdf, FollowsChainsOfMimicsAndNarrowsLimits) {
  // z = 0.5 y + 0.1 = 0.5 (-2 x + 0.2) + 0.1 = -x + 0.2
  const KinematicTree tree = parse_urdf(
      robot(links({"a", "b", "c", "d"}) + joint("x", "a", "b") +
            joint("y", "b", "c", mimic("x", "-2", "0.2")) + joint("z", "c", "d", mimic("y", "0.5", "0.1"))),
      "test.urdf");
  ASSERT_EQ(tree.dof_names, std::vector<std::string>{"x"});
  EXPECT_DOUBLE_EQ(tree.joints[2].multiplier, -1);
  EXPECT_DOUBLE_EQ(tree.joints[2].offset_rad, 0.2);
  EXPECT_DOUBLE_EQ(tree.lower_rad[0], -0.4) << "where y = 1";
  EXPECT_DOUBLE_EQ(tree.upper_rad[0], 0.6) << "where y = -1";
  EXPECT_DOUBLE_EQ(tree.velocity_limit_rad_s[0], 1) << "y turns twice as fast";
  std::vector<Pose> X_HL;
  forward_kinematics(tree, Eigen::VectorXd::Constant(1, 0.3), X_HL);
  const Eigen::AngleAxisd sum(0.3 + (0.2 - 2 * 0.3) + (0.2 - 0.3), Vec3::UnitZ());
  EXPECT_LT((X_HL[3].linear() - sum.toRotationMatrix()).norm(), 1e-14);
}

TEST(Urdf, SlidesPrismaticJoints) {
  const KinematicTree tree = parse_urdf(
      robot(links({"a", "b"}) +
            joint("slide", "a", "b",
                  "<axis xyz='0 2 0'/><limit lower='0' upper='0.04' velocity='1' effort='1'/>", "prismatic")),
      "test.urdf");
  std::vector<Pose> X_HL;
  forward_kinematics(tree, Eigen::VectorXd::Constant(1, 0.03), X_HL);
  EXPECT_LT((X_HL[1].translation() - Vec3(0, 0.03, 0)).norm(), 1e-16);
  Eigen::Matrix3Xd jacobian(3, 1);
  point_jacobian(tree, X_HL, 1, Vec3(1, 2, 3), jacobian);
  EXPECT_EQ(jacobian.col(0), Vec3::UnitY());
}

}  // namespace
}  // namespace geocage::hands
