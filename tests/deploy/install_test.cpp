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

using ::testing::Contains;
using ::testing::ElementsAre;
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

TEST(InstallTest, EachPartHasItsProgramAndWhatBelongsToItAndNothingElse) {
  const TemporaryFolder folder;
  for (const std::string part : {"server", "worker", "client"}) {
    ASSERT_EQ(install(folder, "/usr", part, folder.file(part)).exit_code, 0) << part;
  }
  EXPECT_THAT(
      files_below(folder.file("server")),
      UnorderedElementsAre("usr/bin/oblique-server", "etc/oblique/server.toml",
                           "usr/lib/systemd/system/oblique-server.service",
                           "usr/lib/sysusers.d/oblique-server.conf",
                           "usr/share/doc/oblique-server/copyright",
                           "usr/share/doc/oblique-server/deploy/prometheus/README.md",
                           "usr/share/doc/oblique-server/deploy/prometheus/prometheus.yml",
                           "usr/share/doc/oblique-server/deploy/prometheus/oblique.rules.yml"));
  EXPECT_THAT(files_below(folder.file("worker")),
              UnorderedElementsAre("usr/bin/oblique-worker", "etc/oblique/worker.toml",
                                   "usr/lib/systemd/system/oblique-worker.service",
                                   "usr/lib/systemd/system/oblique-worker@.service",
                                   "usr/share/doc/oblique-worker/copyright"));
  EXPECT_THAT(
      files_below(folder.file("client")),
      IsSupersetOf({"usr/bin/oblique", "usr/share/doc/oblique/copyright",
                    "usr/share/doc/oblique/README.md", "usr/share/doc/oblique/deploy/README.md",
                    "usr/share/doc/oblique/deploy/studies/paper.toml"}));
  EXPECT_THAT(files_below(folder.file("client")),
              Not(Contains(::testing::AnyOf(HasSubstr("/lib/"), HasSubstr("etc/")))));
}

TEST(InstallTest, AStudyRunsFromWhereverTheProgramsAreInstalled) {
  const TemporaryFolder folder;
  const std::string prefix = folder.file("a place");
  ASSERT_EQ(install(folder, prefix).exit_code, 0);
  std::filesystem::create_directory(folder.path() / "bin");
  std::filesystem::create_symlink(prefix + "/bin/oblique", folder.path() / "bin/oblique");
  Process run(folder, folder.file("bin/oblique"),
              {"run", "--H", "1", "--mu", "0.4", "--e", "1", "--db", folder.file("a.db")});
  EXPECT_EQ(run.wait(), 0) << run.err();
  EXPECT_THAT(run.out(), HasSubstr("solved"));
}

TEST(InstallTest, AClientWithoutServerSaysWhatIsMissing) {
  const TemporaryFolder folder;
  const std::string prefix = folder.file("client");
  ASSERT_EQ(install(folder, prefix, "client").exit_code, 0);
  const std::vector<std::string> point{"--H", "1", "--mu", "0.4", "--e", "1"};
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
  EXPECT_THAT(worker.out, HasSubstr("# " + prefix + "/etc/oblique/worker.toml:1\n"));
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
              {"run", "--H", "1", "--mu", "0.4", "--e", "1", "--db", folder.file("a.db")});
  EXPECT_EQ(run.wait(), 0) << run.err();
  EXPECT_THAT(text_of(folder.file("lib/systemd/system/oblique-server.service")),
              HasSubstr("\nExecStart=/opt/oblique/bin/oblique-server "));
}

TEST(PackagesTest, DebiansPackagesDependOnWhatTheirProgramsAreLinkedWith) {
  const TemporaryFolder folder;
  for (const std::string tool : {"dpkg-deb", "dpkg-shlibdeps"}) {
    if (!is_there(folder, tool)) {
      GTEST_SKIP() << "there is no " << tool << " here";
    }
  }
  const auto files = packages(folder, "DEB");
  ASSERT_THAT(files, ElementsAre(HasSubstr("/oblique-server_"), HasSubstr("/oblique-worker_"),
                                 HasSubstr("/oblique_")));
  const auto field = [&](const std::string& file, const std::string& name) {
    return run_tool(folder, "dpkg-deb", {"--field", file, name}).out;
  };
  EXPECT_THAT(field(files[0], "Depends"), HasSubstr("libsqlite3-0"));
  EXPECT_THAT(field(files[0], "Depends"), HasSubstr("systemd-sysusers"));
  EXPECT_THAT(field(files[1], "Depends"), HasSubstr("libzmq5"));
  EXPECT_THAT(field(files[2], "Recommends"), HasSubstr("oblique-server (="));
  EXPECT_THAT(field(files[2], "Recommends"), HasSubstr("oblique-worker (="));
  EXPECT_THAT(run_tool(folder, "dpkg-deb", {"--info", files[0], "conffiles"}).out,
              "/etc/oblique/server.toml\n");
  for (const std::string script : {"postinst", "prerm", "postrm"}) {
    const auto text = run_tool(folder, "dpkg-deb", {"--info", files[0], script}).out;
    std::ofstream(folder.file(script)) << text;
    EXPECT_EQ(run_tool(folder, "sh", {"-n", folder.file(script)}).exit_code, 0) << script;
    EXPECT_THAT(text, Not(HasSubstr("@"))) << script;
  }
  if (is_there(folder, "lintian")) {
    std::vector<std::string> arguments{"--allow-root", "--fail-on", "error"};
    arguments.insert(arguments.end(), files.begin(), files.end());
    const auto objections = run_tool(folder, "lintian", arguments);
    EXPECT_EQ(objections.exit_code, 0) << objections.out;
  }
}

}  // namespace
}  // namespace oblique::test
