#include "datasets/catalogue.h"

#include <algorithm>
#include <cstdlib>
#include <fstream>

#include <gtest/gtest.h>
#include <unistd.h>

#include "pipeline/digest.h"
#include "pipeline/settings.h"

namespace geocage::datasets {
namespace {

namespace fs = std::filesystem;
using pipeline::Fault;

class Catalogue : public testing::Test {
 protected:
  Catalogue() : folder_(fs::path(testing::TempDir()) / ("catalogue-" + std::to_string(getpid()))) {
    fs::create_directories(folder_);
    const char* path = std::getenv("PATH");
    path_ = path ? path : "";
  }
  ~Catalogue() override {
    setenv("PATH", path_.c_str(), 1);
    fs::remove_all(folder_);
  }

  fs::path write(const fs::path& name, const std::string& text) const {
    fs::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name) << text;
    return folder_ / name;
  }
  std::vector<std::string> mistakes_in(const std::string& text) const {
    try {
      load_catalogue(write("catalogue.toml", text));
    } catch (const pipeline::ConfigurationError& error) {
      return error.mistakes();
    }
    return {};
  }

  /// An apt-get that does what `script` says; everything else comes from the machine.
  void fake_apt_get(const std::string& script) const {
    const fs::path program = write("bin/apt-get", "#!/bin/sh\n" + script + "\n");
    fs::permissions(program, fs::perms::owner_all);
    setenv("PATH", (program.parent_path().string() + ":" + path_).c_str(), 1);
  }
  /// A package that holds share/thing.obj with `bytes`, which the fake apt-get brings.
  void serve_package(const std::string& bytes) const {
    write("tree/DEBIAN/control",
          "Package: things\nVersion: 1\nArchitecture: all\nMaintainer: x <x@x>\nDescription: x\n");
    write("tree/share/thing.obj", bytes);
    const std::string build = "dpkg-deb --root-owner-group -b '" + (folder_ / "tree").string() + "' '" +
                              (folder_ / "things_1_all.deb").string() + "' >/dev/null";
    ASSERT_EQ(std::system(build.c_str()), 0);
    fake_apt_get("cp '" + (folder_ / "things_1_all.deb").string() + "' .");
  }

  fs::path folder_;
  std::string path_;
};

Entry thing(const std::string& bytes) {
  Entry entry;
  entry.name = "thing";
  entry.kind = "mesh";
  entry.package = "things";
  entry.version = "1";
  entry.path = "share/thing.obj";
  entry.sha256 = pipeline::sha256_of(bytes);
  entry.licence = "MIT";
  return entry;
}

int files_in(const fs::path& folder) {
  int count = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) count += entry.is_regular_file();
  return count;
}

TEST_F(Catalogue, HoldsTheBuiltInObjects) {
  const auto catalogue = load_catalogue();
  const Entry& scan = find_entry(catalogue, "table_mug");
  EXPECT_EQ(scan.kind, "cloud");
  EXPECT_EQ(scan.scene, "table");
  EXPECT_EQ(scan.unit, "m");
  EXPECT_EQ(scan.licence, "BSD-3-Clause");
  const Entry& mug = find_entry(catalogue, "mug");
  EXPECT_EQ(mug.kind, "mesh");
  EXPECT_EQ(mug.unit, "cm");
  EXPECT_EQ(mug.package, "libmujoco-samples");
}

TEST_F(Catalogue, FollowsTheDataFolder) {
  const Entry entry = thing("x");
  write("datasets/catalogue.toml",
        "[other]\nkind='cloud'\npackage='p'\npath='a'\nlicence='MIT'\nsha256='" + entry.sha256 + "'\n");
  setenv("GEOCAGE_DATA", folder_.c_str(), 1);
  const auto catalogue = load_catalogue();
  unsetenv("GEOCAGE_DATA");
  ASSERT_EQ(catalogue.size(), 1u);
  EXPECT_EQ(catalogue[0].name, "other");
}

TEST_F(Catalogue, TellsTheNearestName) {
  try {
    find_entry(load_catalogue(), "tabel_mug");
    FAIL() << "an unknown name was found";
  } catch (const pipeline::UserError& error) {
    EXPECT_EQ(error.fault(), Fault::configuration);
    EXPECT_NE(error.sentence().find("'table_mug'"), std::string::npos) << error.sentence();
  }
}

TEST_F(Catalogue, TellsAllMistakesWithTheirPlace) {
  const auto mistakes = mistakes_in(
      "[a]\nkind = 'sculpture'\npackage = '-o'\npath = '/etc/passwd'\nsha256 = 'abc'\nlicense = 'MIT'\n"
      "[b]\npath = 'a/../../b'\n");
  const auto told = [&](const std::string& words) {
    return std::any_of(mistakes.begin(), mistakes.end(),
                       [&](const std::string& line) { return line.find(words) != std::string::npos; });
  };
  EXPECT_TRUE(told("catalogue.toml:2:1: error: [a] kind: 'sculpture'"));
  EXPECT_TRUE(told("unknown key 'license'; did you mean 'licence'?"));
  EXPECT_TRUE(told("'-o' is not a name"));
  EXPECT_TRUE(told("'/etc/passwd' leaves"));
  EXPECT_TRUE(told("'a/../../b' leaves"));
  EXPECT_TRUE(told("'abc' is not 64"));
  EXPECT_TRUE(told("[b] 'package' is missing"));
  const auto others = mistakes_in(
      "[c]\nkind='mesh'\nshape='torus'\nsize_m=[0.01, 0.02]\n[d]\nkind='mesh'\nnpm='x'\nurl='http://x'\n");
  const auto all = [&](const std::string& words) {
    return std::ranges::any_of(others,
                               [&](const auto& line) { return line.find(words) != std::string::npos; });
  };
  EXPECT_TRUE(all("[c] size_m: the tube must be thinner"));
  EXPECT_TRUE(all("[d] say one of"));
  EXPECT_TRUE(all("does not begin with https://"));
}

TEST_F(Catalogue, CheckReadsTheBytes) {
  const Entry entry = thing("v 0 0 0\n");
  EXPECT_EQ(check(entry, folder_).presence, Presence::unavailable);
  write(fs::path(entry.sha256) / "thing.obj", "v 0 0 0\n");
  EXPECT_EQ(check(entry, folder_).presence, Presence::have);
  write(fs::path(entry.sha256) / "thing.obj", "v 0 0 1\n");
  const auto damaged = check(entry, folder_);
  EXPECT_EQ(damaged.presence, Presence::mismatch);
  EXPECT_NE(damaged.reason.find(pipeline::sha256_of("v 0 0 1\n")), std::string::npos);
}

TEST_F(Catalogue, GetBringsTheFileOnce) {
  serve_package("v 0 0 0\n");
  const Entry entry = thing("v 0 0 0\n");
  const fs::path cache = folder_ / "cache";
  const auto first = get(entry, cache);
  ASSERT_EQ(first.presence, Presence::fetched) << first.reason;
  EXPECT_EQ(pipeline::sha256_of_file(first.file), entry.sha256);
  EXPECT_EQ(files_in(cache), 1) << "left-overs of the fetch";
  EXPECT_EQ(get(entry, cache).presence, Presence::have);

  std::ofstream(first.file) << "damaged";
  EXPECT_EQ(get(entry, cache).presence, Presence::fetched) << "a damaged file is brought anew";
}

TEST_F(Catalogue, GetRefusesOtherBytes) {
  serve_package("v 9 9 9\n");
  const Entry entry = thing("v 0 0 0\n");
  const auto answer = get(entry, folder_ / "cache");
  EXPECT_EQ(answer.presence, Presence::mismatch);
  EXPECT_NE(answer.reason.find("things_1_all.deb"), std::string::npos) << answer.reason;
  EXPECT_EQ(files_in(folder_ / "cache"), 0);
}

TEST_F(Catalogue, GetTellsWhyAPackageCannotBeHad) {
  const Entry entry = thing("x");
  fake_apt_get("echo 'W: noise'; echo 'E: Unable to locate package things' >&2; exit 100");
  auto answer = get(entry, folder_ / "cache");
  EXPECT_EQ(answer.presence, Presence::unavailable);
  EXPECT_NE(answer.reason.find("E: Unable to locate package things"), std::string::npos) << answer.reason;

  fake_apt_get("echo gibberish > things_1_all.deb");
  answer = get(entry, folder_ / "cache");
  EXPECT_EQ(answer.presence, Presence::unavailable);
  EXPECT_NE(answer.reason.find("dpkg"), std::string::npos) << answer.reason;

  fake_apt_get("sleep 60");
  answer = get(entry, folder_ / "cache", {.download_s = 0.3});
  EXPECT_EQ(answer.presence, Presence::unavailable);
  EXPECT_NE(answer.reason.find("did not end"), std::string::npos) << answer.reason;

  setenv("PATH", (folder_ / "nothing").c_str(), 1);
  answer = get(entry, folder_ / "cache");
  EXPECT_EQ(answer.presence, Presence::unavailable);
  EXPECT_NE(answer.reason.find("apt-get is not on this machine"), std::string::npos) << answer.reason;
  EXPECT_EQ(files_in(folder_ / "cache"), 0);
}

/// A program of this name in place of the machine's, as apt-get above.
TEST_F(Catalogue, UrlsAreBroughtByCurlAndComparedWithTheirDigest) {
  Entry entry = thing("v 0 0 0\n");
  entry.package.clear();
  entry.path.clear();
  entry.url = "https://example.org/sets/thing.obj?raw=1";
  const auto fake_curl = [&](const std::string& script) {
    const fs::path program = write("bin/curl", "#!/bin/sh\n" + script + "\n");
    fs::permissions(program, fs::perms::owner_all);
    setenv("PATH", (program.parent_path().string() + ":" + path_).c_str(), 1);
  };
  fake_curl("while [ \"$1\" != -o ]; do shift; done; printf 'v 0 0 0\\n' > \"$2\"");
  const auto answer = get(entry, folder_ / "cache");
  ASSERT_EQ(answer.presence, Presence::fetched) << answer.reason;
  EXPECT_EQ(answer.file.filename(), "thing.obj");
  EXPECT_EQ(get(entry, folder_ / "cache").presence, Presence::have);

  entry.sha256 = pipeline::sha256_of("other");
  EXPECT_EQ(get(entry, folder_ / "cache").presence, Presence::mismatch);
  fake_curl("echo 'curl: (6) Could not resolve host: example.org' >&2; exit 6");
  const auto away = get(entry, folder_ / "cache");
  EXPECT_EQ(away.presence, Presence::unavailable);
  EXPECT_NE(away.reason.find("Could not resolve host"), std::string::npos) << away.reason;
}

TEST_F(Catalogue, ScriptsBecomeMeshes) {
  const std::string script =
      "exports.positions=[[0,0,0],[1,0,0],[0,1,0],[0,0,1]];exports.cells=[[0,2,1],[0,1,3],[0,3,2],[1,2,3]];";
  Entry entry = thing(script);
  entry.package.clear();
  entry.npm = "tetrahedron";
  entry.path = "package/index.js";
  entry.convert = "javascript";
  write("package/index.js", script);
  const fs::path program = write(
      "bin/npm", "#!/bin/sh\ntar -czf tetrahedron-1.tgz -C '" + folder_.string() + "' package/index.js\n");
  fs::permissions(program, fs::perms::owner_all);
  setenv("PATH", (program.parent_path().string() + ":" + path_).c_str(), 1);
  const auto answer = get(entry, folder_ / "cache");
  ASSERT_EQ(answer.presence, Presence::fetched) << answer.reason;
  EXPECT_EQ(answer.file.extension(), ".ply");
  EXPECT_GT(fs::file_size(answer.file), 4u * 3 * 8);  // four vertices in double
  EXPECT_EQ(check(entry, folder_ / "cache").file, answer.file);
}

TEST_F(Catalogue, ShapesAreMadeAndCheckedByTheirBytes) {
  const Entry torus = find_entry(load_catalogue(), "torus");
  EXPECT_EQ(check(torus, folder_ / "cache").presence, Presence::unavailable);
  const auto made = get(torus, folder_ / "cache");
  ASSERT_EQ(made.presence, Presence::fetched) << made.reason;
  EXPECT_EQ(check(torus, folder_ / "cache").presence, Presence::have);
  std::ofstream(made.file) << "damaged";
  EXPECT_EQ(check(torus, folder_ / "cache").presence, Presence::mismatch);
  EXPECT_EQ(get(torus, folder_ / "cache").presence, Presence::fetched);
  EXPECT_EQ(get(torus, folder_ / "cache").presence, Presence::have);
}

TEST_F(Catalogue, AnOwnFileAddsToTheProjects) {
  setenv("GEOCAGE_CATALOGUE",
         write("own.toml", "[ball]\nkind='mesh'\nshape='sphere'\nsize_m=[0.02]\n").c_str(), 1);
  const auto catalogue = load_catalogue();
  EXPECT_EQ(find_entry(catalogue, "ball").shape, "sphere");
  EXPECT_EQ(find_entry(catalogue, "mug").unit, "cm");
  setenv("GEOCAGE_CATALOGUE",
         write("own.toml", "[mug]\nkind='mesh'\nshape='sphere'\nsize_m=[0.02]\n").c_str(), 1);
  EXPECT_THROW(load_catalogue(), pipeline::ConfigurationError);
  unsetenv("GEOCAGE_CATALOGUE");
}

}  // namespace
}  // namespace geocage::datasets
