#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/deploy/installation.h"

namespace oblique::test {

Outcome install(const TemporaryFolder& folder, const std::string& prefix,
                const std::string& component, const std::string& destination) {
  std::vector<std::string> arguments{"--install", OBLIQUE_BUILD_FOLDER, "--prefix", prefix};
  if (!component.empty()) {
    arguments.insert(arguments.end(), {"--component", component});
  }
  return run_tool(folder, OBLIQUE_CMAKE, arguments,
                  destination.empty() ? Environment{} : Environment{{"DESTDIR", destination}});
}

namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsSupersetOf;
using ::testing::UnorderedElementsAre;

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

/// The same without manual pages, which are there only where help2man was when all was built.
std::vector<std::string> files_beside_pages(const std::string& root) {
  auto files = files_below(root);
  std::erase_if(files, [](const std::string& file) { return file.starts_with("usr/share/man/"); });
  return files;
}

TEST(InstallTest, EachPartHasItsProgramAndWhatBelongsToItAndNothingElse) {
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
    GTEST_SKIP() << "the pages are not built: there was no help2man";
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

TEST(InstallTest, AClientWithoutServerSaysWhatIsMissing) {
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

TEST(InstallTest, ProgramsHeedTheConfigurationOfTheirPrefix) {
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

TEST(InstallTest, WhatTheInstalledConfigurationSuggestsIsAllowed) {
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

TEST(InstallTest, ConfigurationThatSomebodyChangedStays) {
  const TemporaryFolder folder;
  const std::string prefix = folder.file("opt");
  ASSERT_EQ(install(folder, prefix, "server").exit_code, 0);
  const std::string configuration = prefix + "/etc/oblique/server.toml";
  ASSERT_NE(text_of(configuration), "");
  std::ofstream(configuration) << "# mine\n";
  ASSERT_EQ(install(folder, prefix, "server").exit_code, 0);
  EXPECT_EQ(text_of(configuration), "# mine\n");
}

// What cpack makes of what is built.
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
      GTEST_SKIP() << "there is no " << tool << " here";
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

}  // namespace
}  // namespace oblique::test
