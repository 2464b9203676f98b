#include "hands/hand.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include <toml++/toml.h>

#include "pipeline/digest.h"
#include "pipeline/error.h"
#include "pipeline/nearest.h"

namespace geocage::hands {

namespace fs = std::filesystem;
using pipeline::Fault;
using pipeline::UserError;

namespace {

fs::path hands_folder() {
  const char* data = std::getenv("GEOCAGE_DATA");
  return fs::path(data ? data : GEOCAGE_SOURCE_TREE) / "hands";
}

std::string text_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  if (!fs::is_regular_file(file) || !(text << in.rdbuf()))
    throw UserError(Fault::configuration, file.string(), "this file of a hand can't be read",
                    "a hand is a folder with hand.toml and the URDF that it names");
  return text.str();
}

/// A table of hand.toml. Every key is asked for once, with its type; `end` refuses the keys that nobody asked
/// for.
class Table {
 public:
  Table(const toml::table& table, std::string file) : table_(table), file_(std::move(file)) {}

  template <class T>
  T get(const std::string& key) {
    const auto value = node(key).value<T>();
    if (!value) wrong(key, std::is_same_v<T, double> ? "is not a number" : "is not a text");
    if constexpr (std::is_same_v<T, double>) check_finite(key, *value);
    return *value;
  }

  template <class T>
  std::vector<T> list(const std::string& key) {
    std::vector<T> values;
    const toml::array* array = node(key).as_array();
    if (!array) wrong(key, "is not a list");
    for (const auto& element : *array) {
      const auto value = element.value<T>();
      if (!value)
        wrong(key, std::is_same_v<T, double> ? "is not a list of numbers" : "is not a list of texts");
      if constexpr (std::is_same_v<T, double>) check_finite(key, *value);
      values.push_back(*value);
    }
    return values;
  }

  Vec3 vector(const std::string& key) {
    const auto x = list<double>(key);
    if (x.size() != 3) wrong(key, "is not a list of three numbers");
    return {x[0], x[1], x[2]};
  }

  Vec3 direction(const std::string& key) {
    const Vec3 v = vector(key);
    if (v.norm() < 1e-9) wrong(key, "has no direction");
    return v.normalized();
  }

  double length(const std::string& key) {
    const double x = get<double>(key);
    if (!(x > 0 && x < 10)) wrong(key, "is outside (0, 10) m");
    return x;
  }

  std::vector<Table> tables(const std::string& key) {
    std::vector<Table> rows;
    const toml::array* array = node(key).as_array();
    if (!array || array->empty() || !array->is_homogeneous<toml::table>())
      wrong(key, "is not a list of tables: [[" + key + "]]");
    for (const auto& element : *array) rows.emplace_back(*element.as_table(), file_);
    return rows;
  }

  /// An index that `find` looks up by the name in `key`; an unknown name is named with its line.
  template <class Find>
  int index(const std::string& key, const std::string& name, const Find& find) {
    try {
      return find(name);
    } catch (const UserError& error) {
      throw UserError(Fault::configuration, where(*table_.get(key)), error.sentence(), error.hint());
    }
  }

  void end() const {
    for (const auto& [key, value] : table_)
      if (std::find(known_.begin(), known_.end(), key.str()) == known_.end())
        throw UserError(
            Fault::configuration, where(value), "unknown key '" + std::string(key.str()) + "'",
            "the nearest key is '" + pipeline::nearest_name(std::string(key.str()), known_) + "'");
  }

  [[noreturn]] void wrong(const std::string& key, const std::string& sentence) const {
    throw UserError(Fault::configuration, where(*table_.get(key)), key + " " + sentence,
                    "see hands/README.md");
  }

 private:
  const toml::node& node(const std::string& key) {
    known_.push_back(key);
    const toml::node* found = table_.get(key);
    if (!found)
      throw UserError(Fault::configuration, where(table_), "the key '" + key + "' is missing",
                      "see hands/README.md");
    return *found;
  }

  void check_finite(const std::string& key, double x) const {
    if (!std::isfinite(x)) wrong(key, "is not finite");
  }

  std::string where(const toml::node& node) const {
    const auto at = node.source().begin;
    return file_ + ":" + std::to_string(at.line) + ":" + std::to_string(at.column);
  }

  const toml::table& table_;
  std::string file_;
  std::vector<std::string> known_;
};

void read_fingers(Table& table, Hand& hand) {
  const auto dof = [&](const std::string& name) { return hand.tree.dof(name); };
  const auto link = [&](const std::string& name) { return hand.tree.link(name); };
  hand.open_rad.setZero(hand.tree.dofs());
  hand.closing_rad.setZero(hand.tree.dofs());
  for (Table row : table.tables("finger")) {
    Finger finger;
    finger.name = row.get<std::string>("name");
    for (const auto& name : row.list<std::string>("joints"))
      finger.dofs.push_back(row.index("joints", name, dof));
    for (const auto& name : row.list<std::string>("links"))
      finger.links.push_back(row.index("links", name, link));
    const auto open_rad = row.list<double>("open_rad"), closing = row.list<double>("closing");
    const std::size_t n = finger.dofs.size();
    for (auto [key, size] : {std::pair{"links", finger.links.size()},
                             {"open_rad", open_rad.size()},
                             {"closing", closing.size()}})
      if (size != n) row.wrong(key, "has not one entry for each joint");
    for (std::size_t i = 0; i < n; ++i) {
      const int d = finger.dofs[i];
      if (open_rad[i] < hand.tree.lower_rad[d] || open_rad[i] > hand.tree.upper_rad[d])
        row.wrong("open_rad", "is beyond the limits of joint '" + hand.tree.dof_names[d] + "'");
      if (std::abs(closing[i]) != 1) row.wrong("closing", "is neither 1 nor -1");
      hand.open_rad[d] = open_rad[i];
      hand.closing_rad[d] = closing[i];
    }
    row.end();
    hand.fingers.push_back(std::move(finger));
  }
}

void read_capsules(Table& table, Hand& hand) {
  const auto link = [&](const std::string& name) { return hand.tree.link(name); };
  for (Table row : table.tables("capsule")) {
    Capsule capsule;
    capsule.link = row.index("link", row.get<std::string>("link"), link);
    capsule.a_L = row.vector("a_m");
    capsule.b_L = row.vector("b_m");
    capsule.radius_m = row.length("radius_m");
    row.end();
    hand.capsules.push_back(capsule);
  }
}

void read_description(Table& table, Hand& hand) {
  hand.palm_H = table.vector("palm_m");
  hand.approach_H = table.direction("approach");
  hand.flexion_axis_H = table.direction("flexion_axis");
  if (std::abs(hand.approach_H.dot(hand.flexion_axis_H)) > 1e-6)
    table.wrong("flexion_axis", "is not perpendicular to the approach");
  hand.spread_dof = table.get<std::string>("spread_joint");
  if (!hand.spread_dof.empty())
    table.index("spread_joint", hand.spread_dof,
                [&](const std::string& name) { return hand.tree.dof(name); });
  hand.finger_length_m = table.length("finger_length_m");
  hand.ball_radius_m = table.length("ball_radius_m");
  for (double share : table.list<double>("ball_radii_of_finger_length")) {
    if (share <= 0) table.wrong("ball_radii_of_finger_length", "has an entry that is not positive");
    hand.ball_radii_m.push_back(share * hand.finger_length_m);
  }
  read_fingers(table, hand);
  read_capsules(table, hand);
  table.end();
}

/// The folder of hand.toml: a folder, the folder of a URDF, or a name in the project's `hands/`.
fs::path folder_of(const std::string& name_or_path) {
  const fs::path path = name_or_path;
  if (fs::is_directory(path) && fs::exists(path / "hand.toml")) return fs::canonical(path);
  if (path.extension() == ".urdf" && fs::exists(path)) return fs::canonical(path).parent_path();
  const auto known = hand_names();
  if (std::find(known.begin(), known.end(), name_or_path) != known.end())
    return hands_folder() / name_or_path;
  const std::string nearest = pipeline::nearest_name(name_or_path, known);
  throw UserError(
      Fault::configuration, "hand '" + name_or_path + "'", "there is no such hand",
      nearest.empty() ? "no hand lies in " + hands_folder().string() : "did you mean '" + nearest + "'?");
}

}  // namespace

Hand load_hand(const std::string& name_or_path) {
  const fs::path folder = folder_of(name_or_path), description = folder / "hand.toml";
  const std::string text = text_of(description);
  Hand hand;
  hand.name = folder.filename().string();
  try {
    const toml::table parsed = toml::parse(text);
    Table table(parsed, description.string());
    const fs::path urdf = folder / table.get<std::string>("urdf");
    const std::string urdf_text = text_of(urdf);
    hand.sha256 =
        pipeline::sha256_of(hand.name + "\n" + pipeline::sha256_of(text) + pipeline::sha256_of(urdf_text));
    hand.tree = parse_urdf(urdf_text, urdf.string());
    read_description(table, hand);
  } catch (const toml::parse_error& error) {
    const auto at = error.source().begin;
    throw UserError(Fault::configuration,
                    description.string() + ":" + std::to_string(at.line) + ":" + std::to_string(at.column),
                    std::string(error.description()));
  }
  return hand;
}

std::vector<std::string> hand_names() {
  std::vector<std::string> names;
  std::error_code missing;  // no folder, no hands
  for (const auto& entry : fs::directory_iterator(hands_folder(), missing))
    if (fs::exists(entry.path() / "hand.toml")) names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  return names;
}

void place_capsules(const Hand& hand, const Pose& X_WH, const std::vector<Pose>& X_HL,
                    std::vector<PlacedCapsule>& placed) {
  placed.resize(hand.capsules.size());
  for (std::size_t i = 0; i < placed.size(); ++i) {
    const Capsule& capsule = hand.capsules[i];
    const Pose X_WL = X_WH * X_HL[capsule.link];
    placed[i] = {X_WL * capsule.a_L, X_WL * capsule.b_L, capsule.radius_m};
  }
}

}  // namespace geocage::hands
