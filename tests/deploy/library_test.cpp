#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/fmt/fmt.h>
#include <nlohmann/json.hpp>

#include "tests/deploy/installation.h"
#include "tests/support/programs.h"

namespace oblique::test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

/// The parts library and development, installed and then moved elsewhere.
std::string installed_library(const TemporaryFolder& folder) {
  for (const std::string part : {"library", "development"}) {
    const auto installed = install(folder, folder.file("made here"), part);
    EXPECT_EQ(installed.exit_code, 0) << installed.err;
  }
  std::filesystem::rename(folder.file("made here"), folder.file("used here"));
  return folder.file("used here");
}

/// What a program that uses the library has to print of the point that it solves.
std::string expected_of_consumer() {
  const auto solved = run_oblique(
      {"solve", "--preset", "printed", "--H", "1", "--mu", "0.4", "--e", "0.9", "--json"});
  const auto json = nlohmann::json::parse(solved.out);
  return fmt::format("{:.17g} {:.17g} {:.17g} {} {}\n", json["fn_peak_N"].get<double>(),
                     json["duration_s"].get<double>(), json["energy"]["closure"].get<double>(),
                     json["mode"].get<std::string>(), json["solver"]["version"].get<std::string>());
}

TEST(InstalledLibraryTest, AProgramOfSomebodyElseFindsItAndGetsTheBitsOfSolve) {
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

TEST(InstalledLibraryTest, PkgConfigKnowsWhereItIsAndThatItNeedsNothingElse) {
  const TemporaryFolder folder;
  const std::string prefix = installed_library(folder);
  const auto asked = run_tool(
      folder, "sh",
      {"-c", "PKG_CONFIG_PATH=$(dirname \"$(find '" + prefix +
                 "' -name oblique.pc)\") && export PKG_CONFIG_PATH && "
                 "pkg-config --cflags --libs oblique && pkg-config --print-requires oblique"});
  EXPECT_EQ(asked.exit_code, 0) << asked.err;
  EXPECT_THAT(asked.out, AllOf(HasSubstr("used\\ here"), HasSubstr("-loblique"),
                               Not(HasSubstr("made")), ::testing::EndsWith("-loblique \n")));
}

TEST(InstalledLibraryTest, ItsHeadersIncludeNothingButTheStandardLibraryAndEachOther) {
  const TemporaryFolder folder;
  const auto included = run_tool(folder, "sh",
                                 {"-c", "grep -rho '^#include .*' '" + installed_library(folder) +
                                            "/include' | grep -v '<[a-z_]*>$' | sort -u"});
  EXPECT_EQ(included.out,
            "#include <oblique/solver/case_result.h>\n#include <oblique/solver/errors.h>\n"
            "#include <oblique/solver/estimate.h>\n#include <oblique/solver/fall_cache.h>\n"
            "#include <oblique/solver/parameters.h>\n#include <oblique/solver/solve.h>\n"
            "#include <oblique/solver/solve_many.h>\n#include <oblique/solver/trace.h>\n"
            "#include <oblique/solver/version.h>\n");
}

TEST(InstalledLibraryTest, ItShowsNothingButWhatItsHeadersName) {
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

}  // namespace
}  // namespace oblique::test
