#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <system_error>

#include <CLI/CLI.hpp>
#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include "cli/commands.h"
#include "cli/console.h"
#include "cli/help_texts.h"
#include "cli/parameters.h"
#include "datasets/program.h"
#include "pipeline/spelling.h"

namespace geocage::cli {
namespace {

constexpr int exit_configuration = 2, exit_store = 5, exit_bug = 70, exit_interrupted = 130;

constexpr const char* decimate_text =
    "meshes of more than 10 million faces: reduce them to about so many, and mend them";

std::string farewell;  ///< made before it is needed: a handler of signals must not allocate

/// This command line, for a shell.
std::string command_line(int argc, char** argv) {
  std::string text;
  for (int i = 0; i < argc; ++i) text += (i > 0 ? " " : "") + pipeline::for_shell(argv[i]);
  return text;
}

// What a run has published stays; the store needs no unlocking (docs/store.md), and workers die with it.
void interrupted(int signal_id) {
  if (datasets::break_off(signal_id)) return;  // it is raised again
  [[maybe_unused]] const auto written = write(STDERR_FILENO, farewell.data(), farewell.size());
  _exit(exit_interrupted);
}

std::filesystem::path default_store() {
  const char* store = std::getenv("GEOCAGE_STORE");
  return store && *store ? store : "store";
}

/// CLI11's own takes NaN.
CLI::Validator in_range(double least, double most) {
  return {[=](const std::string& text) -> std::string {
            double x = 0;
            const bool number = CLI::detail::lexical_cast(text, x);
            return number && x >= least && x <= most
                       ? ""
                       : fmt::format("'{}' is not a number from {:g} to {:g}", text, least, most);
          },
          fmt::format("{:g} to {:g}", least, most)};
}
const CLI::Validator positive(
    [](const std::string& text) -> std::string {
      double x = 0;
      const bool number = CLI::detail::lexical_cast(text, x);
      return number && x > 0 && std::isfinite(x) ? "" : "'" + text + "' is not a number above 0";
    },
    "ABOVE 0");
const CLI::Validator faces(
    [](const std::string& text) -> std::string {
      int x = 0;
      const bool whole = CLI::detail::lexical_cast(text, x);
      return whole && x > 0 ? "" : "'" + text + "' is not a number of faces";
    },
    "ABOVE 0");

/// An option or argument that was given as "", as an unset variable of a shell is; empty when there is none.
std::string empty_word(const CLI::App& app) {
  for (const CLI::Option* option : app.get_options())
    for (const std::string& word : option->results())
      if (word.empty()) return option->get_name(option->get_positional());
  for (const CLI::App* sub : app.get_subcommands())
    if (const std::string name = empty_word(*sub); !name.empty()) return name;
  return "";
}

/// Builds the commands; the chosen one leaves its work in `chosen`.
class Program {
 public:
  Program() {
    app_.require_subcommand(1);
    app_.footer(footer(""));
    app_.set_version_flag("--version", "geocage " GEOCAGE_VERSION);
    shared_.store = default_store();
    add_flow_commands();
    add_store_commands();
    add_lists();
    add_tools();
    add_manuals();
  }

  int main(int argc, char** argv) {
    try {
      app_.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
      const std::vector<std::string> words(argv + 1, argv + argc);
      const std::string unknown = error.get_exit_code() == 0 ? "" : unknown_word(app_, words);
      if (unknown.empty()) return app_.exit(error, std::cout, std::cerr) == 0 ? 0 : exit_configuration;
      tell(fmt::format("error: {} (--help lists them)\n", unknown));
      return exit_configuration;
    }
    if (const std::string name = empty_word(app_); !name.empty()) {
      tell(fmt::format("{}: error: the value is empty\n", name));
      return exit_configuration;
    }
    return chosen_();
  }

 private:
  CLI::App* command(const char* name, const char* what, const std::function<int()>& work,
                    CLI::App* parent = nullptr) {
    CLI::App* sub = (parent ? parent : &app_)->add_subcommand(name, what);
    sub->footer(footer(parent ? parent->get_name() + " " + name : std::string(name)));
    sub->add_option("--store", shared_.store, "folder of the store (default: $GEOCAGE_STORE or ./store)");
    sub->add_flag("--json", shared_.json, "one JSON document on stdout and nothing else");
    sub->add_flag("--quiet", shared_.quiet, "no progress");
    sub->callback([this, sub, work] {
      if (sub->get_subcommands().empty()) chosen_ = work;  // `datasets get` is not `datasets`
    });
    return sub;
  }

  CLI::App* flow_command(const char* name, const char* what, const std::function<int()>& work,
                         bool with_slot = false) {
    CLI::App* sub = command(name, what, work);
    if (with_slot) sub->add_option("SLOT", slot_, "a slot, as `geocage status` lists them")->required();
    sub->add_option("FLOW", run_.flow.file, "flow file (TOML); the built-in flow without it");
    sub->add_option("--dataset", run_.flow.dataset, "a folder of meshes and clouds, or a catalogue name");
    sub->add_option("--object", run_.flow.object, "this object only");
    sub->add_option("--hand", run_.flow.hand, "this hand: a name, a folder or a URDF");
    sub->add_option("--set", run_.flow.sets, "stage.field=value, any number of times")
        ->expected(1)
        ->take_all();
    sub->add_option("--out", shared_.out, "folder of the report");
    return sub;
  }

  void add_pictures(CLI::App* sub) {
    sub->add_option("--pictures", run_.pictures, "draw so many pairs at most; all are in the tables")
        ->check(CLI::Range(0, 1'000'000));
  }

  void add_flow_commands() {
    CLI::App* sub =
        flow_command("run", "make what is missing, then the report", [this] { return run(shared_, run_); });
    sub->add_option("--only", run_.wish.only, "these slots alone")->expected(1)->take_all();
    sub->add_option("--until", run_.wish.until, "these slots and what they need")->expected(1)->take_all();
    sub->add_option("--force", run_.wish.force, "make these slots anew")->expected(1)->take_all();
    sub->add_option("--jobs", run_.wish.jobs, "slots made at the same time")->check(CLI::Range(1, 1024));
    sub->add_flag("--single-file", run_.single_file, "the report as one HTML file, report.html");
    sub->add_flag("--dry-run", run_.dry_run, "say what would be made and why; make nothing");
    sub->add_option(
           "--retry",
           [this](const std::vector<std::string>& words) {
             run_.retry_failed = words.front() == "failed";
             return run_.retry_failed;
           },
           "`failed`: try again what failed before")
        ->type_name("failed")
        ->check(CLI::IsMember({"failed"}));
    sub->add_option("--memory-gib", run_.wish.memory_gib,
                    "for all slots made at once (default: 4/5 of the machine's)")
        ->check(in_range(1e-3, 1e6));
    add_pictures(sub);
    sub->add_option("--stage-seconds", run_.stage_seconds, "a slot that takes longer fails")
        ->check(in_range(1e-3, 1e8));
    sub->add_option("--stage-memory-gib", run_.stage_memory_gib, "a slot that takes more fails")
        ->check(in_range(1e-3, 1e6));
    flow_command("status", "every slot: hit, miss, or ? where an input is not made yet",
                 [this] { return status(shared_, run_.flow); });
    flow_command(
        "why", "why a slot is, or was, made anew", [this] { return why(shared_, run_.flow, slot_); }, true);
    flow_command(
        "show", "what a slot holds", [this] { return show(shared_, run_.flow, slot_); }, true);
    flow_command("graph", "the dataflow as DOT", [this] { return graph(shared_, run_.flow); });
    sub = flow_command("report", "write the report of what is made",
                       [this] { return report(shared_, run_.flow, run_.single_file, run_.pictures); });
    sub->add_flag("--single-file", run_.single_file, "one HTML file, report.html");
    add_pictures(sub);
  }

  void add_store_commands() {
    command("metrics", "metrics of many slots of the store, as CSV",
            [this] { return metrics(shared_, slot_); })
        ->add_option("PATTERN", slot_, "a glob of slots, such as '*/remesh'")
        ->required();
    command("failures", "the ledger: what failed, why, and how to see it again",
            [this] { return failures(shared_); });
    CLI::App* sub = command("query", "a select statement over the results of a run",
                            [this] { return query(shared_, query_); });
    sub->add_option(
           "SQL", query_.statement,
           "such as \"select * from rates\"; tables: grasps, rates, paired, losses, agreement, slots")
        ->required();
    sub->add_option("--database", query_.database, "results.sqlite (default: in the folder of the report)");
    sub->add_option("--out", shared_.out, "folder of the report");
    sub->add_flag("--csv", query_.csv, "comma-separated values");
    command("verify", "check every artefact against its digest", [this] { return verify(shared_); });
    command("gc", "remove what no slot needs", [this] {
      return collect_garbage(shared_, dry_run_);
    })->add_flag("--dry-run", dry_run_, "say what would go");
  }

  void add_lists() {
    command("stages", "the stages, in the order of the dataflow", [this] { return list_stages(shared_); });
    command("params", "the parameters of a stage", [this] { return list_params(shared_, name_); })
        ->add_option("STAGE", name_)
        ->required();
    CLI::App* hands = command("hands", "the hands", [this] { return list_hands(shared_, pictures_); });
    hands->add_option("--pictures", pictures_, "a folder that gets a picture of each hand, open and closed");
    command(
        "check", "what a hand still needs", [this] { return check_hand(shared_, name_); }, hands)
        ->add_option("HAND", name_, "a name, a folder or a URDF")
        ->required();
    CLI::App* datasets =
        command("datasets", "the catalogue of objects", [this] { return list_datasets(shared_); });
    command(
        "check", "which objects are here, with the right digest", [this] { return check_datasets(shared_); },
        datasets);
    command(
        "get", "bring an object, a set, or all of them", [this] { return get_dataset(shared_, name_); },
        datasets)
        ->add_option("NAME", name_)
        ->required();
  }

  void add_manuals() {
    command("man", "this manual, for `man -l -`", [this] {
      fmt::print("{}", man_page(app_));
      return 0;
    });
    command("completion", "a script that completes commands and options in bash", [this] {
      fmt::print("{}", bash_completion(app_));
      return 0;
    });
  }

  void add_tools() {
    CLI::App* sub =
        command("score", "S1 and S2 of every vertex of a mesh", [this] { return score(shared_, score_); });
    sub->add_option("MESH", score_.mesh)->required();
    sub->add_option("--radius-m", score_.radius_m, "radius of the geodesic balls")
        ->required()
        ->check(positive);
    sub->add_option("--out", score_.out, "FILE.ply or FILE.csv (default: CSV on stdout)");
    sub->add_option("--metric", score_.metric, "hop or dijkstra")->check(CLI::IsMember({"hop", "dijkstra"}));
    sub->add_option("--units", score_.unit, "unit of the file: m, cm, mm, inch, or metres per unit");
    sub->add_option("--decimate", score_.decimate, decimate_text)->check(faces);

    sub = command("writhe", "writhe matrix and Gauss linking integral of two polylines",
                  [this] { return writhe(shared_, writhe_); });
    sub->add_option("A", writhe_.a, "CSV, one x,y,z a line")->required();
    sub->add_option("B", writhe_.b)->required();
    sub->add_flag("--closed", writhe_.closed, "join the last point to the first, of both");

    sub = command("view", "a page that shows meshes, scores, clouds, grasps and ways in 3-D",
                  [this] { return view(shared_, view_); });
    sub->add_option("FILE", view_.files, "mesh, scores (PLY), cloud, grasp(s) or trajectory (JSON)")
        ->required();
    sub->add_option("--hand", view_.hand, "of a trajectory; a grasp names its own");
    sub->add_option("--units", view_.unit, "unit of meshes: m, cm, mm, inch, or metres per unit");
    sub->add_option("--out", shared_.out, "folder of the page");

    sub = command("plan", "search the motion that a scene asks for, and prove it free",
                  [this] { return plan(shared_, scene_); });
    sub->add_option("SCENE", scene_, "robot, obstacles, tasks and horizon (TOML; docs/planning.md)")
        ->required();

    sub = command("evaluate", "test a grasp in physics", [this] { return evaluate(shared_, evaluate_); });
    sub->add_option("--mesh", evaluate_.mesh)->required();
    sub->add_option("--hand", evaluate_.hand)->required();
    sub->add_option("--grasp", evaluate_.grasp, "a geocage-grasp file")->required();
    sub->add_option("--protocol", evaluate_.protocol,
                    "preset, several with commas, or all (default: geocage-force)");
    force_option<std::string>(
        sub, "--loads", "loads",
        "of geocage-force: axes (six pushes, the default), or all (26 pushes and six torques)");
    force_option<double>(sub, "--friction", "friction", "of geocage-force: Coulomb's mu (default: 0.6)");
    force_option<double>(sub, "--push-m-s2", "push_m_s2", "of geocage-force: push per mass (default: 10)");
    auto* mass =
        force_option<double>(sub, "--mass-kg", "mass_kg", "of geocage-force: of the object (default: 0.1)");
    force_option<double>(sub, "--density-kg-m3", "density_kg_m3",
                         "of geocage-force: of the object's solid, in place of its mass")
        ->excludes(mass);
    sub->add_option("--units", evaluate_.unit, "unit of the mesh: m, cm, mm, inch, or metres per unit");
    sub->add_option("--decimate", evaluate_.decimate, decimate_text)->check(faces);
    sub->add_flag("--margins", evaluate_.margins,
                  "also bisect the smallest friction, largest push and noise, and how far fingers may open");
    sub->add_option("--record", evaluate_.record, "write every trial there, for playback");
  }

  /// A parameter of the stage evaluate.
  template <class Value>
  CLI::Option* force_option(CLI::App* sub, const char* flag, const char* field, const char* help) {
    return sub->add_option_function<Value>(
        flag,
        [this, flag, field](const Value& value) {
          evaluate_.force.push_back({flag, "evaluate", field, value});
        },
        help);
  }

  CLI::App app_{"geocage: from noisy point clouds of objects to tested caging grasps"};
  Shared shared_;
  RunOptions run_;
  ScoreOptions score_;
  WritheOptions writhe_;
  EvaluateOptions evaluate_;
  ViewOptions view_;
  QueryOptions query_;
  std::string slot_, name_;
  std::filesystem::path pictures_, scene_;
  bool dry_run_ = false;
  std::function<int()> chosen_;
};

int guarded_main(int argc, char** argv) {
  try {
    const int code = Program().main(argc, argv);
    errno = 0;
    if (std::fflush(stdout) != 0 ||
        std::ferror(stdout))  // what was printed by C++ streams may have failed before
      throw std::system_error(errno != 0 ? errno : EIO, std::generic_category(), "stdout");
    return code;
  } catch (const pipeline::UserError& error) {
    tell(fmt::format("{}\n", error.what()));
    return static_cast<int>(error.fault());
  } catch (const std::system_error& error) {
    tell(fmt::format("geocage: error: {}\n", error.what()));
    return exit_store;
  } catch (const std::exception& error) {
    tell(fmt::format("geocage: this is a bug: {}\n", error.what()));
    return exit_bug;
  }
}

/// Where a standard stream is closed, the next file that is opened would be taken for it.
void open_closed_streams() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    if (fcntl(stream, F_GETFD) < 0) open("/dev/null", O_RDWR);  // gets the lowest number that is free
}

}  // namespace
}  // namespace geocage::cli

int main(int argc, char** argv) {
  using namespace geocage::cli;
  open_closed_streams();
  farewell = "\ngeocage: interrupted; what was made stays, and the same command goes on from here:\n  " +
             command_line(argc, argv) + "\n";
  signal(SIGINT, interrupted);
  signal(SIGTERM, interrupted);
  if (signal(SIGHUP, interrupted) == SIG_IGN) signal(SIGHUP, SIG_IGN);  // as nohup wants it
  return guarded_main(argc, argv);
}
