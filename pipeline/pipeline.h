#pragma once
#include <algorithm>
#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "pipeline/error.h"
#include "pipeline/stage.h"
#include "pipeline/store.h"
#include "pipeline/worker.h"

namespace geocage::pipeline {

enum class SlotState { made, hit, failed, skipped };
std::string_view word(SlotState state);

/// What became of one slot in one run.
struct SlotResult {
  std::string slot, stage;
  SlotState state = SlotState::skipped;
  double seconds = 0;          ///< spent in this run
  double made_seconds = 0;     ///< spent when it was made
  double peak_memory_gib = 0;  ///< of the worker that made it; 0: not known
  std::filesystem::path folder;
  std::map<std::string, double> metrics;
  std::string sentence;  ///< why it failed or was skipped
  std::string code;      ///< of a failure, as the ledger has it
  bool known = false;    ///< it failed before, and was not tried again
};

/// Hears of a run while it goes on; called from several threads, one at a time.
class Watcher {
 public:
  virtual ~Watcher() = default;
  virtual void started(const std::string& /*slot*/, std::size_t /*ended*/, std::size_t /*total*/) {}
  virtual void progress(const std::string& /*slot*/, std::size_t /*done*/, std::size_t /*total*/) {}
  virtual void log(const std::string& /*slot*/, std::string_view /*sentence*/) {}
  virtual void ended(const SlotResult& /*result*/, std::size_t /*ended*/, std::size_t /*total*/) {}
};

/// Which slots to make. A pattern is a slot, the beginning of one ("mug", "mug/place"), a stage, or a glob.
struct Wish {
  std::vector<std::string> only;   ///< these slots; what they need is made if it is missing
  std::vector<std::string> until;  ///< these slots and everything upstream of them
  std::vector<std::string> force;  ///< made anew even when they are there
  int jobs = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  double memory_gib = 0;  ///< for all slots that are made at once; 0: four fifths of the machine's
  int cores =
      static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));  ///< which those slots share
};

/// Every slot is made in a worker process of its own, so that a crash, a hang or running out of memory is a
/// failure of that slot; failures go to the store's ledger and are not tried again until the recipe or the
/// program changes. The process itself must not use OpenMP or TBB before its last slot is made.
struct Guard {
  WorkerLimits limits;
  bool retry_failed = false;
  /// Called in each worker first, with the cores that it may use (`follow`); more when others end.
  std::function<void(const std::atomic<int>& share)> prepare;
  std::string command;  ///< repeats a failure when " --force SLOT --only SLOT" is put after it
};

/// What would become of a slot, and why.
struct Forecast {
  std::string slot, state;  ///< hit, make, failed (as before), or `after` where an input must be made first
  std::string reason;       ///< never made, input changed, parameter changed, version changed, ...
};

struct Node;

/// A promise of a value.
template <class T>
struct Target {
  Node* node = nullptr;
};

/// One slot: how to make it and what it is made from.
struct Node {
  std::string slot, stage, kind, parameters;
  int version = 0;
  std::vector<Node*> inputs;
  std::function<void(Run&, const std::filesystem::path&)> make;  ///< computes the value and saves it there
  bool constant = false;
  double memory_gib = 0.25;

  const std::atomic<int>* share = nullptr;  ///< of the cores, while it is made
  std::optional<std::string> content;       ///< once settled
  SlotResult result;
  bool failed_here = false;  ///< tried by this process
  std::mutex value_mutex;
  std::weak_ptr<const void> value;  ///< shared by the slots that read it at the same time
};

/// A dataflow graph over a store. Slots are added in an order in which inputs come first.
class Pipeline {
 public:
  explicit Pipeline(const Store& store) : store_(store) {}
  /// From now on slots are made, and their failures kept, in this way.
  void guard(Guard guard) { guard_ = std::move(guard); }

  /// Errors: UserError (configuration) when the slot is there already.
  template <Artefact Out, class Params, class... In>
  Target<Out> add(const std::string& slot, const Stage<Out, Params, In...>& stage, Params params,
                  std::type_identity_t<Target<In>>... inputs);

  /// A value from outside; recipes know it by `content`, the digest of what it was read from.
  template <class T>
  Target<T> constant(const std::string& kind, T value, const std::string& content);

  /// The value, made if it is missing, read (and verified) from the store if not. Throws what the stage
  /// threw.
  template <Artefact T>
  std::shared_ptr<const T> get(const Target<T>& target);

  /// Makes what is asked for; a result a slot, in the order they were added. A stage's failure is a result;
  /// trouble with the store (std::system_error) ends the run.
  std::vector<SlotResult> run(const Wish& wish, Watcher& watcher);

  /// What is there already, as results: `hit`, or `skipped` because it is not made yet.
  std::vector<SlotResult> present();
  /// What run(wish) would do with each slot; makes nothing.
  std::vector<Forecast> forecast(const Wish& wish);
  /// hit, miss, or ? where an input is not made yet.
  std::vector<std::pair<std::string, std::string>> status();
  /// Why the slot would be made, or was made last: the differing lines of its recipe, old and new.
  std::string why(const std::string& slot);
  std::string graph_dot() const;
  std::vector<std::string> slots() const;
  /// Slots that a pattern means; UserError (configuration) with the nearest name when there is none.
  std::vector<std::string> matching(const std::string& pattern) const;

 private:
  Node& add_node(const std::string& slot);
  Node& node(const std::string& slot);
  std::optional<std::string> recipe_of(const Node& node) const;
  /// What a wish asks for and all it needs, inputs first; `asked` gets the slots that were named.
  std::vector<Node*> chosen(const Wish& wish, std::set<std::string>& asked);
  void look_up(Node& node);
  void settle(Node& node, bool forced, Watcher& watcher);
  /// Whether the ledger knows that it fails, with this recipe and this program; the node's result says so
  /// then.
  bool failed_before(Node& node, const std::string& key) const;
  /// The ledger's word on a slot that is not made, whichever program tried it.
  void recall_failure(Node& node) const;
  void keep_failure(const Node& node, const std::string& key) const;
  Forecast forecast_of(Node& node, bool forced);
  double make_contained(Node& node, Run& run, const std::filesystem::path& scratch, Watcher& watcher);
  void make(Node& node, const std::string& recipe, Watcher& watcher);
  void accept(Node& node, const Record& record, SlotState state) const;
  void note(const Node& node, const std::string& recipe) const;
  std::string reasons(Node& node, int depth);

  template <class T>
  static std::shared_ptr<const T> value_of(const Store& store, Node& node);

  const Store& store_;
  std::optional<Guard> guard_;
  std::vector<std::unique_ptr<Node>> nodes_;
  std::map<std::string, Node*> by_slot_;
};

/// Values of a parameter struct as recipe lines: "param edge_length_m = 0.004\n".
std::string parameter_lines(const Fields& fields);

template <class T>
std::shared_ptr<const T> Pipeline::value_of(const Store& store, Node& node) {
  const std::lock_guard lock(node.value_mutex);
  if (auto known = node.value.lock()) return std::static_pointer_cast<const T>(known);
  auto value = std::make_shared<T>();
  if constexpr (Artefact<T>) load_artefact(*value, store.folder(*node.content));
  node.value = value;
  return value;
}

template <Artefact Out, class Params, class... In>
Target<Out> Pipeline::add(const std::string& slot, const Stage<Out, Params, In...>& stage, Params params,
                          std::type_identity_t<Target<In>>... inputs) {
  Node& node = add_node(slot);
  node.stage = stage.name;
  node.version = stage.version;
  node.memory_gib = stage.memory_gib;
  node.kind = artefact_kind(static_cast<const Out*>(nullptr));
  node.parameters = parameter_lines(fields_of(params));
  (node.inputs.push_back(inputs.node), ...);
  node.make = [this, stage, params, inputs...](Run& run, const std::filesystem::path& folder) {
    save_artefact(stage.make(params, run, *value_of<In>(store_, *inputs.node)...), folder);
  };
  return {&node};
}

template <class T>
Target<T> Pipeline::constant(const std::string& kind, T value, const std::string& content) {
  nodes_.push_back(std::make_unique<Node>());
  Node& node = *nodes_.back();
  node.kind = kind;
  node.constant = true;
  node.content = content;
  auto kept = std::make_shared<const T>(std::move(value));
  node.value = kept;
  node.make = [kept](Run&, const std::filesystem::path&) {};  // keeps the value alive
  return {&node};
}

template <Artefact T>
std::shared_ptr<const T> Pipeline::get(const Target<T>& target) {
  Watcher quiet;
  if (!target.node->content) run({.only = {target.node->slot}}, quiet);
  if (!target.node->content)
    throw UserError(Fault::geometry, target.node->slot, target.node->result.sentence);
  return value_of<T>(store_, *target.node);
}

}  // namespace geocage::pipeline
