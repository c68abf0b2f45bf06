// Installed and packaged files, programs that run from them, and checks of the units by systemd.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/fmt/fmt.h>
#include <nlohmann/json.hpp>

#include "tests/support/process.h"
#include "tests/support/programs.h"

namespace oblique::test {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::IsSupersetOf;
using ::testing::Not;
using ::testing::UnorderedElementsAre;

/// Runs `program`, found in PATH, in `folder` until it ends.
Outcome run_tool(const TemporaryFolder& folder, const std::string& program,
                 const std::vector<std::string>& arguments, const Environment& environment = {}) {
  std::vector<std::string> line{program};
  line.insert(line.end(), arguments.begin(), arguments.end());
  Process process(folder, "/usr/bin/env", line, environment);
  return process.outcome();
}

/// Returns true if PATH contains `program`.
bool is_there(const TemporaryFolder& folder, const std::string& program) {
  return run_tool(folder, "which", {program}).exit_code == 0;
}

/// Installs `component`, or all if it is empty, for `prefix`. `destination` is an optional staging
/// folder. Returns the outcome of cmake --install.
Outcome install(const TemporaryFolder& folder, const std::string& prefix,
                const std::string& component = "", const std::string& destination = "") {
  std::vector<std::string> arguments{"--install", OBLIQUE_BUILD_FOLDER, "--prefix", prefix};
  if (!component.empty()) {
    arguments.insert(arguments.end(), {"--component", component});
  }
  return run_tool(folder, OBLIQUE_CMAKE, arguments,
                  destination.empty() ? Environment{} : Environment{{"DESTDIR", destination}});
}

std::vector<std::string> files_below(const std::string& root) {
  std::vector<std::string> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(root)) {
    if (!entry.is_directory()) {
      files.push_back(entry.path().lexically_relative(root).string());
    }
  }
  return files;
}

std::string text_of(const std::string& file) {
  std::ifstream stream(file);
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// Lists the files below `root` except manual pages, which exist only if the build had help2man.
std::vector<std::string> files_beside_pages(const std::string& root) {
  auto files = files_below(root);
  std::erase_if(files, [](const std::string& file) { return file.starts_with("usr/share/man/"); });
  return files;
}

TEST(InstallTest, EachPartHasOnlyItsProgramAndFiles) {
  const TemporaryFolder folder;
  for (const std::string part : {"server", "worker", "client"}) {
    ASSERT_EQ(install(folder, "/usr", part, folder.file(part)).exit_code, 0) << part;
  }
  EXPECT_THAT(
      files_beside_pages(folder.file("server")),
      UnorderedElementsAre(
          "usr/bin/oblique-server", "usr/share/bash-completion/completions/oblique-server",
          "usr/share/zsh/vendor-completions/_oblique-server", "etc/oblique/server.toml",
          "usr/lib/systemd/system/oblique-server.service", "usr/lib/sysusers.d/oblique-server.conf",
          "usr/share/doc/oblique-server/copyright",
          "usr/share/doc/oblique-server/deploy/prometheus/README.md",
          "usr/share/doc/oblique-server/deploy/prometheus/prometheus.yml",
          "usr/share/doc/oblique-server/deploy/prometheus/oblique.rules.yml"));
  EXPECT_THAT(files_beside_pages(folder.file("worker")),
              UnorderedElementsAre(
                  "usr/bin/oblique-worker", "usr/share/bash-completion/completions/oblique-worker",
                  "usr/share/zsh/vendor-completions/_oblique-worker", "etc/oblique/worker.toml",
                  "usr/lib/systemd/system/oblique-worker.service",
                  "usr/lib/systemd/system/oblique-worker@.service",
                  "usr/share/doc/oblique-worker/copyright"));
  EXPECT_THAT(
      files_below(folder.file("client")),
      IsSupersetOf({"usr/bin/oblique", "usr/share/doc/oblique/copyright",
                    "usr/share/doc/oblique/README.md", "usr/share/doc/oblique/deploy/README.md",
                    "usr/share/doc/oblique/deploy/studies/paper.toml",
                    "usr/share/bash-completion/completions/oblique",
                    "usr/share/zsh/vendor-completions/_oblique"}));
  EXPECT_THAT(files_below(folder.file("client")),
              Not(Contains(::testing::AnyOf(HasSubstr("/lib/"), HasSubstr("etc/")))));
}

TEST(InstallTest, EachPartHasTheManualPagesOfItsProgramWithTheDateOfTheTree) {
  if (!std::filesystem::exists(OBLIQUE_BUILD_FOLDER "/proto/program/manual/pages/made")) {
    GTEST_SKIP() << "the manual pages are not built because help2man is missing";
  }
  const TemporaryFolder folder;
  for (const std::string part : {"server", "worker", "client"}) {
    ASSERT_EQ(install(folder, "/usr", part, folder.file(part)).exit_code, 0) << part;
  }
  const std::string pages = "/usr/share/man/man1/";
  EXPECT_THAT(files_below(folder.file("server" + pages)), UnorderedElementsAre("oblique-server.1"));
  EXPECT_THAT(files_below(folder.file("worker" + pages)), UnorderedElementsAre("oblique-worker.1"));
  EXPECT_THAT(files_below(folder.file("client" + pages)),
              IsSupersetOf({"oblique.1", "oblique-query.1", "oblique-keys.1"}));
  EXPECT_THAT(
      text_of(folder.file("server" + pages + "oblique-server.1")),
      ::testing::ContainsRegex("[.]TH OBLIQUE-SERVER 1 \"20[0-9][0-9]-[01][0-9]-[0-3][0-9]\""));
}

TEST(InstallTest, AStudyRunsFromWhereverTheProgramsAreInstalled) {
  const TemporaryFolder folder;
  const std::string prefix = folder.file("a place");
  ASSERT_EQ(install(folder, prefix).exit_code, 0);
  std::filesystem::create_directory(folder.path() / "bin");
  std::filesystem::create_symlink(prefix + "/bin/oblique", folder.path() / "bin/oblique");
  Process run(folder, folder.file("bin/oblique"),
              {"run", "--preset", "paper", "--H", "1", "--mu", "0.4", "--e", "1", "--db",
               folder.file("a.db")});
  EXPECT_EQ(run.wait(), 0) << run.err();
  EXPECT_THAT(run.out(), HasSubstr("solved"));
}

TEST(InstallTest, AClientWithoutServerNamesTheMissingProgram) {
  const TemporaryFolder folder;
  const std::string prefix = folder.file("client");
  ASSERT_EQ(install(folder, prefix, "client").exit_code, 0);
  const std::vector<std::string> point{"--preset", "paper", "--H", "1", "--mu", "0.4", "--e", "1"};
  std::vector<std::string> arguments{"solve"};
  arguments.insert(arguments.end(), point.begin(), point.end());
  Process solve(folder, prefix + "/bin/oblique", arguments);
  EXPECT_EQ(solve.wait(), 0) << solve.err();
  arguments.front() = "run";
  Process run(folder, prefix + "/bin/oblique", arguments);
  EXPECT_EQ(run.wait(), 1);
  EXPECT_THAT(run.err(), HasSubstr(prefix + "/bin/oblique-worker"));
  EXPECT_THAT(run.err(), HasSubstr("package"));
}

TEST(InstallTest, UnitsNameTheProgramsAndTheConfigurationOfTheirPrefix) {
  const TemporaryFolder folder;
  const std::string prefix = folder.file("opt");
  ASSERT_EQ(install(folder, prefix, "worker").exit_code, 0);
  EXPECT_THAT(text_of(prefix + "/lib/systemd/system/oblique-worker.service"),
              HasSubstr("\nExecStart=" + prefix + "/bin/oblique-worker --config " + prefix +
                        "/etc/oblique/worker.toml\n"));
  EXPECT_THAT(text_of(prefix + "/lib/systemd/system/oblique-worker@.service"),
              HasSubstr(" --config " + prefix + "/etc/oblique/%i.toml\n"));
}

TEST(InstallTest, ProgramsReadTheConfigurationOfTheirPrefix) {
  const TemporaryFolder folder;
  const std::string prefix = folder.file("opt");
  ASSERT_EQ(install(folder, prefix).exit_code, 0);
  std::ofstream(prefix + "/etc/oblique/worker.toml") << "server = \"tcp://lab:7601\"\n";
  const auto worker =
      run_tool(folder, "env",
               {"-u", "OBLIQUE_WORKER_CONFIG", prefix + "/bin/oblique-worker", "--print-config"});
  EXPECT_EQ(worker.exit_code, 0) << worker.err;
  EXPECT_THAT(worker.out, AllOf(HasSubstr("read from " + prefix + "/etc/oblique/worker.toml\n"),
                                HasSubstr("\nserver = \"tcp://lab:7601\"\n")));
}

TEST(InstallTest, SettingsInInstalledConfigurationAreValid) {
  const TemporaryFolder folder;
  const std::string prefix = folder.file("opt");
  ASSERT_EQ(install(folder, prefix).exit_code, 0);
  for (const std::string part : {"server", "worker"}) {
    const std::string file = prefix + "/etc/oblique/" + part + ".toml";
    std::string suggested =
        std::regex_replace(text_of(file), std::regex("\n# ([a-z_]+ = |\\[)"), "\n$1");
    ASSERT_NE(suggested, text_of(file));
    std::ofstream(file) << suggested;
    Process program(folder, prefix + "/bin/oblique-" + part, {"--config", file, "--print-config"});
    EXPECT_EQ(program.wait(), 0) << program.err();
  }
}

TEST(InstallTest, AnInstallKeepsEditedConfiguration) {
  const TemporaryFolder folder;
  const std::string prefix = folder.file("opt");
  ASSERT_EQ(install(folder, prefix, "server").exit_code, 0);
  const std::string configuration = prefix + "/etc/oblique/server.toml";
  ASSERT_NE(text_of(configuration), "");
  std::ofstream(configuration) << "# mine\n";
  ASSERT_EQ(install(folder, prefix, "server").exit_code, 0);
  EXPECT_EQ(text_of(configuration), "# mine\n");
}

// Makes packages with cpack and returns their paths.
std::vector<std::string> packages(const TemporaryFolder& folder, const std::string& generator) {
  const auto packing = run_tool(folder, OBLIQUE_CPACK,
                                {"--config", OBLIQUE_BUILD_FOLDER "/CPackConfig.cmake", "-G",
                                 generator, "-B", folder.file(generator)});
  EXPECT_EQ(packing.exit_code, 0) << packing.out << packing.err;
  std::vector<std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder.file(generator))) {
    if (entry.is_regular_file()) {
      files.push_back(entry.path().string());
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

TEST(PackagesTest, TheArchiveRunsWhereItIsUnpackedWithLibrariesOfItsOwn) {
  const TemporaryFolder folder;
  for (const std::string tool : {"patchelf", "dpkg-query"}) {
    if (!is_there(folder, tool)) {
      GTEST_SKIP() << tool << " is not installed";
    }
  }
  const auto archives = packages(folder, "TGZ");
  ASSERT_EQ(archives.size(), 1U);
  ASSERT_EQ(run_tool(folder, "tar", {"-xzf", archives.front(), "--strip-components=1"}).exit_code,
            0);
  for (const std::string program : {"oblique", "oblique-server", "oblique-worker"}) {
    const auto linked = run_tool(folder, "ldd", {folder.file("bin/" + program)});
    EXPECT_THAT(linked.out, HasSubstr(folder.file("bin/../lib/oblique/libstdc++.so.6")));
    EXPECT_THAT(linked.out, Not(HasSubstr("not found")));
    EXPECT_EQ(linked.exit_code, 0);
  }
  Process run(folder, folder.file("bin/oblique"),
              {"run", "--preset", "paper", "--H", "1", "--mu", "0.4", "--e", "1", "--db",
               folder.file("a.db")});
  EXPECT_EQ(run.wait(), 0) << run.err();
  EXPECT_THAT(text_of(folder.file("lib/systemd/system/oblique-server.service")),
              HasSubstr("\nExecStart=/opt/oblique/bin/oblique-server "));
}

// ---- The library ----

/// Installs the components `library` and `development`, then moves them. Returns their folder.
std::string installed_library(const TemporaryFolder& folder) {
  for (const std::string part : {"library", "development"}) {
    const auto installed = install(folder, folder.file("made here"), part);
    EXPECT_EQ(installed.exit_code, 0) << installed.err;
  }
  std::filesystem::rename(folder.file("made here"), folder.file("used here"));
  return folder.file("used here");
}

/// Expected output of a program that uses the library.
std::string expected_of_consumer() {
  const auto solved = run_oblique(
      {"solve", "--preset", "printed", "--H", "1", "--mu", "0.4", "--e", "0.9", "--json"});
  const auto json = nlohmann::json::parse(solved.out);
  return fmt::format("{:.17g} {:.17g} {:.17g} {} {}\n", json["fn_peak_N"].get<double>(),
                     json["duration_s"].get<double>(), json["energy"]["closure"].get<double>(),
                     json["mode"].get<std::string>(), json["solver"]["version"].get<std::string>());
}

TEST(InstalledLibraryTest, AUserProgramLinksTheLibraryAndGetsTheSameBitsAsSolve) {
  const TemporaryFolder folder;
  const std::string prefix = installed_library(folder);
  const std::string build = folder.file("build");
  const auto configured =
      run_tool(folder, OBLIQUE_CMAKE,
               {"-S", OBLIQUE_SOURCE_FOLDER "/tests/deploy/consumer", "-B", build, "-G", "Ninja",
                "-DCMAKE_BUILD_TYPE=Release", "-DCMAKE_CXX_COMPILER=" OBLIQUE_COMPILER,
                "-DCMAKE_PREFIX_PATH=" + prefix});
  ASSERT_EQ(configured.exit_code, 0) << configured.err;
  const auto built = run_tool(folder, OBLIQUE_CMAKE, {"--build", build});
  ASSERT_EQ(built.exit_code, 0) << built.out;
  const auto run = run_tool(folder, build + "/consumer", {});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(run.out, expected_of_consumer() + "mu = -0.4 is not allowed: mu must be >= 0\n");
}

TEST(InstalledLibraryTest, PkgConfigFindsTheLibraryWithoutDependencies) {
  const TemporaryFolder folder;
  const std::string prefix = installed_library(folder);
  const auto flags = run_tool(
      folder, "sh",
      {"-c", "PKG_CONFIG_PATH=$(dirname \"$(find '" + prefix +
                 "' -name oblique.pc)\") && export PKG_CONFIG_PATH && "
                 "pkg-config --cflags --libs oblique && pkg-config --print-requires oblique"});
  EXPECT_EQ(flags.exit_code, 0) << flags.err;
  EXPECT_THAT(flags.out, AllOf(HasSubstr("used\\ here"), HasSubstr("-loblique"),
                               Not(HasSubstr("made")), ::testing::EndsWith("-loblique \n")));
}

TEST(InstalledLibraryTest, HeadersIncludeOnlyTheStandardLibraryAndEachOther) {
  const TemporaryFolder folder;
  const auto included = run_tool(folder, "sh",
                                 {"-c", "grep -rho '^#include .*' '" + installed_library(folder) +
                                            "/include' | grep -v '<[a-z_]*>$' | sort -u"});
  EXPECT_EQ(included.out,
            "#include <oblique/solver/case_result.h>\n#include <oblique/solver/errors.h>\n"
            "#include <oblique/solver/estimate.h>\n#include <oblique/solver/fall_cache.h>\n"
            "#include <oblique/solver/parameters.h>\n#include <oblique/solver/solve.h>\n"
            "#include <oblique/solver/solve_many.h>\n#include <oblique/solver/trace.h>\n");
}

TEST(InstalledLibraryTest, TheLibraryExportsOnlyTheNamesInItsHeaders) {
  const TemporaryFolder folder;
  const auto shown = run_tool(
      folder, "sh",
      {"-c",
       "nm --dynamic --defined-only --demangle '" + installed_library(folder) +
           "/'lib*/liboblique.so | cut -c20- | "
           "grep -vE '^(typeinfo( name)?|vtable) for oblique::solver::(Input|Solve)Error@|"
           "^OBLIQUE_' | grep -vE '^oblique::solver::(Finger|FallCache|solve_|solver_version|"
           "[a-z_]*(instruction_set|companion|errors|key|value|validate|integrator|preset))'"});
  EXPECT_THAT(shown.out, IsEmpty());
}

// ---- Units ----

// Installs everything and returns the paths of the systemd units.
std::vector<std::string> installed_units(const TemporaryFolder& folder) {
  const std::string prefix = folder.file("prefix");
  EXPECT_EQ(install(folder, prefix).exit_code, 0);
  const std::string units = prefix + "/lib/systemd/system/";
  // Renames the template unit to the instance `lab`.
  std::filesystem::rename(units + "oblique-worker@.service", units + "oblique-worker@lab.service");
  return {units + "oblique-server.service", units + "oblique-worker.service",
          units + "oblique-worker@lab.service"};
}

TEST(UnitsTest, SystemdFindsNoErrorsAndFewPermissions) {
  const TemporaryFolder folder;
  if (!is_there(folder, "systemd-analyze")) {
    GTEST_SKIP() << "systemd-analyze is not installed";
  }
  for (const auto& unit : installed_units(folder)) {
    const auto verified = run_tool(folder, "systemd-analyze", {"verify", "--man=no", unit});
    EXPECT_EQ(verified.exit_code, 0) << unit;
    EXPECT_EQ(verified.err, "") << unit << ": systemd-analyze prints settings that it ignores";
    // --threshold=13 allows an exposure level up to 1.3. The level is 1.2, because the programs
    // need network, local sockets and threads.
    const auto judged =
        run_tool(folder, "systemd-analyze",
                 {"security", "--offline=true", "--threshold=13", "--no-pager", unit});
    EXPECT_EQ(judged.exit_code, 0) << unit << "\n" << judged.out << judged.err;
  }
}

}  // namespace
}  // namespace oblique::test
