#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/deploy/installation.h"

namespace oblique::test {
namespace {

// Installed units, by file.
std::vector<std::string> installed_units(const TemporaryFolder& folder) {
  const std::string prefix = folder.file("prefix");
  EXPECT_EQ(install(folder, prefix).exit_code, 0);
  const std::string units = prefix + "/lib/systemd/system/";
  // The template, as one instance.
  std::filesystem::rename(units + "oblique-worker@.service", units + "oblique-worker@lab.service");
  return {units + "oblique-server.service", units + "oblique-worker.service",
          units + "oblique-worker@lab.service"};
}

TEST(UnitsTest, SystemdFindsNothingWrongWithThem) {
  const TemporaryFolder folder;
  if (!is_there(folder, "systemd-analyze")) {
    GTEST_SKIP() << "there is no systemd-analyze here";
  }
  for (const auto& unit : installed_units(folder)) {
    const auto verified = run_tool(folder, "systemd-analyze", {"verify", "--man=no", unit});
    EXPECT_EQ(verified.exit_code, 0) << unit;
    // What it ignores, it tells and lets pass.
    EXPECT_EQ(verified.err, "") << unit;
  }
}

TEST(UnitsTest, SystemdCountsLittleThatTheyLeaveOpen) {
  const TemporaryFolder folder;
  if (!is_there(folder, "systemd-analyze")) {
    GTEST_SKIP() << "there is no systemd-analyze here";
  }
  for (const auto& unit : installed_units(folder)) {
    // Of 100: 1.2 of 10 for the network, local sockets and what libzmq asks of its threads.
    const auto judged =
        run_tool(folder, "systemd-analyze",
                 {"security", "--offline=true", "--threshold=13", "--no-pager", unit});
    EXPECT_EQ(judged.exit_code, 0) << unit << "\n" << judged.out << judged.err;
  }
}

}  // namespace
}  // namespace oblique::test
