#include "cli/flow.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <map>
#include <set>
#include <sstream>

#include <fmt/format.h>

#include "cli/muted_stdout.h"
#include "geometry/scene.h"
#include "geometry/source_file.h"
#include "pipeline/digest.h"

namespace geocage::cli {

namespace fs = std::filesystem;
using pipeline::ConfigurationError;
using pipeline::Pipeline;
using pipeline::Setting;
using pipeline::Target;

namespace {

/// A flow file taken apart, before objects are looked up.
struct Script {
  std::string name, where, text;
  std::vector<std::string> objects, hands;
  std::vector<Setting> stage_settings;
  std::vector<std::pair<std::string, Setting>>
      object_settings;  ///< object's name, and a setting for it alone
  std::vector<Setting> sweep;
};

fs::path built_in_flow() {
  const char* data = std::getenv("GEOCAGE_DATA");
  return fs::path(data ? data : GEOCAGE_DATA_DIR) / "flows" / "demo.toml";
}

/// A list names each thing once: all that is made is named after it.
void refuse_twins(const std::vector<std::string>& list, const Setting& setting,
                  std::vector<std::string>& mistakes) {
  std::set<std::string> seen;
  for (const auto& item : list)
    if (!seen.insert(item).second)
      mistakes.push_back(
          pipeline::mistake(setting.where, setting.stage, setting.field + ": '" + item + "' is there twice"));
}

void read_top_level(const Setting& setting, Script& script, std::vector<std::string>& mistakes) {
  pipeline::Fields keys;
  keys("objects", script.objects, {}, "catalogue names, files or globs");
  keys("hands", script.hands, {}, "names, folders or URDFs");
  const auto before = mistakes.size();
  pipeline::apply(setting, keys, mistakes);
  if (mistakes.size() > before) return;
  const auto& list = setting.field == "hands" ? script.hands : script.objects;
  if (setting.field == "hands" && list.empty())
    mistakes.push_back(pipeline::mistake(setting.where, "",
                                         "hands: the list is empty (without it, the hand is schunk_sdh)"));
  refuse_twins(list, setting, mistakes);
}

/// `[object.mug.remesh]`: the object's name may hold dots, the stage may not.
void read_object_setting(Setting setting, Script& script) {
  const auto last = setting.stage.rfind('.');
  const std::string name = setting.stage.substr(7, last == 6 ? 0 : last - 7);
  setting.stage = setting.stage.substr(last + 1);
  script.object_settings.emplace_back(name, std::move(setting));
}

Script read_script(const FlowRequest& request, std::vector<std::string>& mistakes) {
  Script script;
  const fs::path file = request.file.value_or(built_in_flow());
  script.name = file.stem();
  script.where = file.string();
  const auto settings = pipeline::read_settings(file);
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  script.text = text.str();
  for (Setting setting : settings) {
    if (setting.stage.empty()) {
      read_top_level(setting, script, mistakes);
    } else if (setting.stage.starts_with("object.")) {
      read_object_setting(std::move(setting), script);
    } else if (setting.stage == "sweep" || setting.stage.starts_with("sweep.")) {
      if (setting.stage != "sweep") setting.field = setting.stage.substr(6) + "." + setting.field;
      script.sweep.push_back(std::move(setting));
    } else {
      script.stage_settings.push_back(std::move(setting));
    }
  }
  for (const auto& set : request.sets) script.stage_settings.push_back(pipeline::parse_setting(set));
  if (!request.hand.empty()) script.hands = {request.hand};
  if (script.hands.empty()) script.hands = {"schunk_sdh"};
  return script;
}

std::vector<FlowObject> flow_objects(const FlowRequest& request, const Script& script) {
  std::vector<FlowObject> objects;
  std::error_code error;  // a name may be too long for a file
  if (request.dataset.empty()) {
    const bool replaced = !request.object.empty() &&
                          std::count(script.objects.begin(), script.objects.end(), request.object) == 0;
    objects =
        replaced ? find_objects({request.object}, "--object") : find_objects(script.objects, script.where);
    if (replaced) return objects;
  } else if (fs::is_directory(request.dataset, error)) {
    objects = objects_of_folder(request.dataset);
  } else {
    objects = find_objects({request.dataset}, "--dataset");
  }
  if (request.object.empty()) return objects;
  std::vector<std::string> names;
  for (auto& object : objects) {
    names.push_back(object.name);
    if (object.cloud && request.object.starts_with(object.name + "."))  // an object of a scene
      object.part = request.object.substr(object.name.size() + 1);
  }
  std::erase_if(objects, [&](const FlowObject& object) {
    return object.name != request.object && object.part.empty();
  });
  if (objects.empty())
    throw ConfigurationError(
        {pipeline::mistake("--object " + request.object, "",
                           "there is no such object" + pipeline::did_you_mean(request.object, names))});
  return objects;
}

/// One point of the product of a sweep's lists.
struct Variant {
  std::string name;
  std::vector<Setting> settings;
  std::vector<std::pair<std::string, std::string>> levels;
};

std::vector<Setting> levels_of(const Setting& list) {
  const auto dot = list.field.rfind('.');
  std::vector<Setting> levels;
  const auto add = [&](pipeline::SettingValue value) {
    const std::string stage = dot == std::string::npos ? "" : list.field.substr(0, dot);
    levels.push_back({list.where, stage, list.field.substr(dot + 1), std::move(value)});
  };
  if (const auto* numbers = std::get_if<std::vector<double>>(&list.value)) {
    for (double x : *numbers)
      if (x == std::floor(x) && std::abs(x) < 1e15)
        add(static_cast<std::int64_t>(x));
      else
        add(x);
  } else if (const auto* texts = std::get_if<std::vector<std::string>>(&list.value)) {
    for (const auto& text : *texts) add(text);
  } else {
    add(list.value);
  }
  return levels;
}

std::string level_value(const Setting& level) {
  struct Shown {
    std::string operator()(bool x) const { return x ? "true" : "false"; }
    std::string operator()(std::int64_t x) const { return std::to_string(x); }
    std::string operator()(double x) const { return pipeline::value_text({"", &x, {}, {}, ""}); }
    std::string operator()(const std::string& x) const { return x; }
    std::string operator()(const std::vector<double>&) const { return "list"; }
    std::string operator()(const std::vector<std::string>&) const { return "list"; }
  };
  return std::visit(Shown{}, level.value);
}

std::string level_name(const Setting& level) {
  std::string name = level.stage + "." + level.field + "=" + level_value(level);
  std::replace(name.begin(), name.end(), '/', '_');
  return name;
}

void check_sweep(const std::vector<Setting>& sweep, std::vector<std::string>& mistakes) {
  std::set<std::string> fields;  // "scan.seed" may stand in [sweep] and in [sweep.scan]
  for (const Setting& list : sweep) {
    if (!fields.insert(list.field).second)
      mistakes.push_back(pipeline::mistake(list.where, list.stage, list.field + " is there twice"));
    std::vector<std::string> values;
    for (const Setting& level : levels_of(list)) values.push_back(level_value(level));
    if (values.empty())
      mistakes.push_back(pipeline::mistake(list.where, list.stage, list.field + ": the list is empty"));
    refuse_twins(values, list, mistakes);
  }
}

std::vector<Variant> variants_of(const std::vector<Setting>& sweep) {
  std::vector<Variant> variants = {{}};
  for (const Setting& list : sweep) {
    std::vector<Variant> product;
    for (const Variant& variant : variants)
      for (const Setting& level : levels_of(list)) {
        product.push_back(variant);
        product.back().name += (variant.name.empty() ? "@" : ",") + level_name(level);
        product.back().settings.push_back(level);
        product.back().levels.emplace_back(level.stage + "." + level.field, level_value(level));
      }
    variants = std::move(product);
  }
  return variants;
}

/// What a run sets itself, whatever is said.
void refuse_own(const Script& script, std::vector<std::string>& mistakes) {
  std::vector<Setting> all = script.stage_settings;
  for (const auto& [object, setting] : script.object_settings) all.push_back(setting);
  for (const auto& variant : variants_of(script.sweep))
    all.insert(all.end(), variant.settings.begin(), variant.settings.end());
  for (const auto& setting : all)
    if (setting.field == "object_geometry" && (setting.stage == "evaluate" || setting.stage == "cage"))
      mistakes.push_back(pipeline::mistake(setting.where, setting.stage,
                                           "object_geometry follows from the object: the true mesh where one "
                                           "is known, the reconstruction of a scan"));
}

/// ConfigurationError with all mistakes that need no object to be seen.
Script checked_script(const FlowRequest& request) {
  std::vector<std::string> mistakes;
  Script script = read_script(request, mistakes);
  StageParameters scratch;
  apply_all(script.stage_settings, scratch, mistakes);
  for (const auto& variant : variants_of(script.sweep)) apply_all(variant.settings, scratch, mistakes);
  for (const auto& [object, setting] : script.object_settings) apply_all({setting}, scratch, mistakes);
  check_sweep(script.sweep, mistakes);
  refuse_own(script, mistakes);
  if (mistakes.empty()) return script;
  std::set<std::string> seen;
  std::erase_if(mistakes, [&](const std::string& line) { return !seen.insert(line).second; });
  throw ConfigurationError(mistakes);
}

std::string error_of(const fs::path& path) {
  std::error_code error;
  const auto kind = fs::status(path, error).type();
  const auto sentence = [&](const std::string& words) { return path.string() + ": error: " + words; };
  if (kind == fs::file_type::not_found) return sentence("there is no such file");
  if (kind == fs::file_type::directory) return sentence("this is a folder, not a mesh or cloud file");
  if (kind != fs::file_type::regular) return sentence("this is not a regular file");
  return "";
}

/// Who set a parameter, the flow or the command line, or else a catalogue or folder.
struct Origin {
  std::string where;
  bool by_user;
};
/// By "stage.field", the last one that did.
using Origins = std::map<std::string, Origin>;

/// The parameters of an object (or of one of a scene) by its name.
struct Chosen {
  StageParameters parameters;
  Origins origins;
};
using ParametersOf = std::function<Chosen(const std::string&)>;

void apply_known(const std::vector<Setting>& settings, const std::string& who, bool by_user, Chosen& chosen,
                 std::vector<std::string>& mistakes) {
  apply_all(settings, chosen.parameters, mistakes);
  for (const auto& setting : settings)
    chosen.origins[setting.stage + "." + setting.field] = {who.empty() ? setting.where : who, by_user};
}

/// Adds the slots of one object in one variant, for all hands.
class Planner {
 public:
  Planner(Pipeline& pipeline, Flow& flow, std::vector<Target<hands::Hand>> hands)
      : pipeline_(pipeline), flow_(flow), hands_(std::move(hands)) {}

  void add(const FlowObject& object, const Variant& variant, const ParametersOf& parameters_of) {
    name_ = object.name + variant.name;
    levels_ = variant.levels;
    shared_.clear();
    std::string failed = object.failed;
    if (object.skipped.empty() && failed.empty()) failed = error_of(object.path);
    if (!object.skipped.empty() || !failed.empty()) {
      add_lost_pairs(object, object.skipped, failed);
      return;
    }
    const Chosen chosen = parameters_of(object.name);
    const StageParameters& parameters = chosen.parameters;
    origins_ = chosen.origins;
    if (object.cloud && parameters.noise.surface == "truth") {
      add_lost_pairs(object, "",
                     object.path.string() +
                         ": error: a scan has no true surface (say noise.surface = "
                         "'reconstruction', or take a mesh)");
      return;
    }
    if (object.cloud && parameters.import.scene != "object" && parameters.import.cluster == "all")
      add_scene(object, variant, parameters, parameters_of);
    else
      add_file(object, parameters);
  }

  /// Settings that do nothing for any slot.
  void refuse_idle(std::vector<std::string>& mistakes) const {
    for (const auto& [said, use] : uses_) {
      const auto& [where, stage, field] = said;
      if (!use.counts)
        mistakes.push_back(pipeline::mistake(where, stage, field + " does nothing: " + use.why));
    }
  }

 private:
  Target<geometry::SourceFile> file_of(const FlowObject& object) {
    return pipeline_.constant("file" + object.path.extension().string(), geometry::SourceFile{object.path},
                              pipeline::sha256_of_file(object.path));
  }

  /// Pairs of an object that has no slots, or none but `shared_`.
  void add_lost_pairs(const FlowObject& object, const std::string& skipped, const std::string& failed) {
    for (const auto& hand : flow_.hands) {
      FlowPair pair = new_pair(object, hand);
      pair.skipped = skipped;
      pair.failed = failed;
      pair.slots = shared_;
      flow_.pairs.push_back(pair);
    }
  }

  /// How many objects a scene holds is known only once it was looked at, so its slot is made while planning.
  void add_scene(const FlowObject& object, const Variant& variant, const StageParameters& parameters,
                 const ParametersOf& parameters_of) {
    const auto scene = slot("scene", stages::scene_stage, parameters.import, file_of(object));
    std::shared_ptr<const geometry::Scene> seen;
    try {
      const MutedStdout muted;
      seen = pipeline_.get(scene);
    } catch (const pipeline::UserError& error) {
      add_lost_pairs(object, "", error.sentence());
      return;
    }
    const auto scene_slots = shared_;
    std::vector<std::string> names;
    bool added = false;
    for (std::size_t k = 0; k < seen->objects.size(); ++k) {
      const std::string& part = seen->objects[k].name;
      names.push_back(part);
      if (!object.part.empty() && part != object.part) continue;
      FlowObject one = object;
      if (!part.empty()) one.name += "." + part;
      name_ = one.name + variant.name;
      shared_ = scene_slots;
      const stages::PartParams part_params{static_cast<int>(k)};
      const Chosen chosen = parameters_of(one.name);
      origins_ = chosen.origins;
      add_slots(one, chosen.parameters, slot("import", stages::import_part_stage, part_params, scene), {});
      added = true;
    }
    if (!added)
      throw ConfigurationError(
          {pipeline::mistake("--object " + object.name + "." + object.part, "",
                             "the scene holds no such object" + pipeline::did_you_mean(object.part, names))});
  }

  void add_file(const FlowObject& object, const StageParameters& p) {
    if (object.cloud) {
      add_slots(object, p, slot("import", stages::import_cloud_stage, p.import, file_of(object)), {});
      return;
    }
    const auto truth = slot("import", stages::import_mesh_stage, p.import, file_of(object));
    add_slots(object, p, slot("scan", stages::scan_stage, p.scan, truth), truth);
  }

  FlowPair new_pair(const FlowObject& object, const hands::Hand& hand) const {
    FlowPair pair;
    pair.object = name_;
    pair.base = object.name;
    pair.levels = levels_;
    pair.hand = hand.name;
    pair.source = object.source;
    pair.up_O = object.up_O;
    pair.truth_known = !object.cloud;
    return pair;
  }

  template <class Out, class Params, class... In>
  Target<Out> slot(const std::string& label, const pipeline::Stage<Out, Params, In...>& stage, Params params,
                   std::type_identity_t<Target<In>>... inputs) {
    const std::string name = name_ + "/" + label;
    auto& listed = flow_.parameters.emplace_back(name, std::vector<reports::ParameterInput>{}).second;
    Params defaults;
    const pipeline::Fields fields = pipeline::fields_of(params), plain = pipeline::fields_of(defaults);
    const std::string group = stage.name == std::string_view("scene") ? "import" : std::string(stage.name);
    for (std::size_t i = 0; i < fields.list().size(); ++i) {
      const auto& field = fields.list()[i];
      const std::string value = pipeline::value_text(field);
      const auto origin = origins_.find(group + "." + std::string(field.name));
      if (origin != origins_.end() && origin->second.by_user)
        note_use(origin->second.where, group, field, fields);
      listed.push_back({std::string(field.name), value,
                        origin != origins_.end()                         ? origin->second.where
                        : value == pipeline::value_text(plain.list()[i]) ? "default"
                                                                         : "the object or hand"});
    }
    shared_.push_back(name);
    return pipeline_.add(name, stage, params, inputs...);
  }

  void note_use(const std::string& where, const std::string& stage, const pipeline::Field& field,
                const pipeline::Fields& fields) {
    const std::string why = pipeline::why_idle(field, fields);
    auto& use = uses_[{where, stage, field.name}];
    use.counts |= why.empty();
    use.why = why;
  }

  /// Everything downstream of what was seen; `truth` is the true mesh of what is no cloud.
  void add_slots(const FlowObject& object, const StageParameters& p, const Target<geometry::PointCloud>& seen,
                 const Target<geometry::TriangleMesh>& truth) {
    const auto cloud = slot("cloud", stages::cloud_stage, p.cloud, seen);
    const auto occupancy = slot("occupancy", stages::occupancy_stage, p.occupancy, cloud);
    const bool true_surface = p.noise.surface == "truth";
    const auto surface =
        true_surface ? truth : slot("reconstruct", stages::reconstruct_stage, p.reconstruct, cloud);
    const auto clean = slot("remesh", stages::remesh_stage, p.remesh, surface);
    const auto mesh = p.noise.asked() ? slot("noise", stages::noise_stage, p.noise, clean) : clean;
    if (!object.cloud) {
      if (!true_surface) slot("surface_accuracy", stages::accuracy_stage, p.accuracy, surface, truth);
      slot("mesh_accuracy", stages::accuracy_stage, p.accuracy, mesh, truth);
    }
    auto reference = clean;
    if (p.agreement.reference == "truth" && !object.cloud && !true_surface)
      reference = slot("reference_mesh", stages::remesh_stage, p.remesh, truth);
    const bool compared =
        p.agreement.reference == "clean" || (p.agreement.reference == "truth" && !object.cloud);
    const auto field = slot("field", stages::field_stage, p.field, mesh);
    const auto others = slot("clearance", stages::clearance_stage, p.clearance, occupancy, cloud, field);
    const auto tested = object.cloud ? mesh : truth;
    const auto tested_field = object.cloud ? field : slot("truth_field", stages::field_stage, p.field, truth);

    const auto object_slots = shared_;
    for (std::size_t i = 0; i < hands_.size(); ++i) {
      shared_ = object_slots;
      const hands::Hand& hand = flow_.hands[i];
      const auto of_hand = [&](const char* stage) { return std::string(stage) + "/" + hand.name; };
      auto balls_params = p.balls;
      if (balls_params.radii_m.empty()) balls_params.radii_m = radii_of(hand);
      auto evaluate_params = p.evaluate;
      auto place_params = p.place;
      if (place_params.object.empty()) place_params.object = object.name;
      evaluate_params.object_geometry = object.cloud ? "reconstruction" : "truth";

      const auto balls = slot(of_hand("balls"), stages::balls_stage, balls_params, mesh);
      const auto scores = slot(of_hand("score"), stages::score_stage, p.score, mesh, balls);
      if (compared) {
        const auto clean_balls =
            slot(of_hand("reference_balls"), stages::balls_stage, balls_params, reference);
        const auto clean_scores =
            slot(of_hand("reference_score"), stages::score_stage, p.score, reference, clean_balls);
        slot(of_hand("agreement"), stages::agreement_stage, p.agreement, clean_scores, scores);
      }
      const auto grasps =
          slot(of_hand("place"), stages::place_stage, place_params, scores, field, cloud, others, hands_[i]);
      const auto ways = slot(of_hand("approach"), stages::approach_stage, p.approach, grasps, field, cloud,
                             others, hands_[i]);
      slot(of_hand("evaluate"), stages::evaluate_stage, evaluate_params, grasps, ways, tested, tested_field,
           hands_[i]);
      auto cage_params = p.cage;
      cage_params.object_geometry = evaluate_params.object_geometry;
      slot(of_hand("cage"), stages::cage_stage, cage_params, grasps, tested, tested_field, hands_[i]);

      FlowPair pair = new_pair(object, hand);
      pair.slots = shared_;
      if (compared) pair.agreement_slot = name_ + "/" + of_hand("agreement");
      pair.metric = p.balls.metric;
      for (auto [stage, at] : {std::pair{"score", &pair.score_slot},
                               {"place", &pair.place_slot},
                               {"approach", &pair.approach_slot},
                               {"evaluate", &pair.evaluate_slot},
                               {"cage", &pair.cage_slot}})
        *at = name_ + "/" + of_hand(stage);
      flow_.pairs.push_back(pair);
    }
  }

  static std::vector<double> radii_of(const hands::Hand& hand) {
    std::vector<double> radii = {hand.ball_radius_m};
    for (double radius : hand.ball_radii_m)
      if (std::count(radii.begin(), radii.end(), radius) == 0) radii.push_back(radius);
    return radii;
  }

  Pipeline& pipeline_;
  Flow& flow_;
  std::vector<Target<hands::Hand>> hands_;
  std::string name_;
  std::vector<std::pair<std::string, std::string>> levels_;
  Origins origins_;
  struct Use {
    bool counts = false;
    std::string why;  ///< not, last time
  };
  std::map<std::array<std::string, 3>, Use> uses_;  ///< of settings: where they stand, stage, field
  std::vector<std::string> shared_;                 ///< slots of the object, and of the pair under way
};

/// Settings for an object that the flow does not have: `named` were met; what a lost scene holds is not
/// known.
void check_names(const Script& script, const Flow& flow, const std::set<std::string>& named,
                 std::vector<std::string>& mistakes) {
  std::vector<std::string> names;
  for (const auto& pair : flow.pairs) names.push_back(pair.base);
  std::set<std::string> told;
  for (const auto& [name, setting] : script.object_settings) {
    const bool lost = std::ranges::any_of(flow.pairs, [&, &name = name](const FlowPair& pair) {
      return pair.lost() && (name == pair.base || name.starts_with(pair.base + "."));
    });
    if (lost || named.contains(name) || !told.insert(name).second) continue;
    mistakes.push_back(
        pipeline::mistake(setting.where, "object." + name,
                          "the flow has no such object" + pipeline::did_you_mean(name, names)));
  }
}

}  // namespace

void check_flow(const FlowRequest& request) {
  for (const auto& name : checked_script(request).hands) hands::load_hand(name);
}

Flow plan_flow(const FlowRequest& request, Pipeline& pipeline) {
  const Script script = checked_script(request);
  std::vector<std::string> mistakes;
  Flow flow;
  flow.name = script.name;
  flow.text = script.text;
  for (const auto& name : script.hands) flow.hands.push_back(hands::load_hand(name));
  const auto variants = variants_of(script.sweep);
  for (const auto& list : script.sweep) flow.swept.push_back(list.field);

  std::vector<Target<hands::Hand>> hands;
  for (const auto& hand : flow.hands) hands.push_back(pipeline.constant("hand", hand, hand.sha256));
  Planner planner(pipeline, flow, std::move(hands));
  std::set<std::string> named;  // by object settings, and met
  const auto objects = flow_objects(request, script);
  for (const auto& object : objects)
    for (const auto& variant : variants)
      planner.add(object, variant, [&](const std::string& name) {
        Chosen chosen;
        apply_known(object.settings, "", false, chosen, mistakes);
        apply_known(script.stage_settings, "", true, chosen, mistakes);
        for (const auto& [known, setting] : script.object_settings)
          if (known == object.name || known == name) {
            named.insert(known);
            apply_known({setting}, setting.where + " [object." + known + "]", true, chosen, mistakes);
          }
        apply_known(variant.settings, "the sweep", true, chosen, mistakes);
        return chosen;
      });
  if (request.object.empty() && request.dataset.empty()) check_names(script, flow, named, mistakes);
  planner.refuse_idle(mistakes);
  if (!mistakes.empty()) throw ConfigurationError(mistakes);
  return flow;
}

}  // namespace geocage::cli
