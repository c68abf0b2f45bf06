// Commands that extend, rename and delete studies.
#include <fstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/client/service/scripted_server.h"
#include "tests/support/programs.h"
#include "tests/support/temporary_folder.h"

namespace oblique::client {
namespace {

using testing::HasSubstr;
using testing::Not;

/// A study file of `blocks` blocks with two points each. More blocks only append points.
std::string study_text(int blocks) {
  std::string text = "name = \"friction\"\n[model]\npreset = \"paper\"\n";
  for (int block = 0; block < blocks; ++block) {
    text += "[[block]]\nH = 1.0\ne = 1.0\nmu = [0." + std::to_string(2 * block + 1) + ", 0." +
            std::to_string(2 * block + 2) + "]\n";
  }
  return text;
}

class StudyChanges : public testing::Test {
 protected:
  test::Outcome run_command(const std::vector<std::string>& words) {
    return test::run_oblique(folder_, words);
  }
  test::Outcome run_study(int blocks) {
    std::ofstream(folder_.file("friction.toml")) << study_text(blocks);
    return run_command({"run", "friction.toml"});
  }

  test::TemporaryFolder folder_;
};

TEST_F(StudyChanges, AStudyWithMoreBlocksSolvesOnlyTheNewPoints) {
  ASSERT_EQ(run_study(1).exit_code, 0);
  const auto grown = run_study(2);
  EXPECT_EQ(grown.exit_code, 0) << grown.err;
  EXPECT_EQ(run_command({"query", "friction", "--select", "point,mu", "--format", "csv"}).out,
            "point,mu\n0,0.1\n1,0.2\n2,0.3\n3,0.4\n");
  const auto shorter = run_study(1);
  EXPECT_EQ(shorter.exit_code, 1);
  EXPECT_THAT(shorter.err, HasSubstr("stored 2 blocks, given 1"));
}

TEST_F(StudyChanges, ADifferentStudyOfTheSameNameIsRefusedWithTheDifferences) {
  ASSERT_EQ(run_study(1).exit_code, 0);
  const auto other = run_command({"run", "--H", "1", "--mu", "0.1,0.3", "--e", "1", "--preset",
                                  "printed", "--name", "friction"});
  EXPECT_EQ(other.exit_code, 1);
  EXPECT_THAT(other.err, HasSubstr("\nmodel, "));
  EXPECT_THAT(other.err, HasSubstr("\nblock 1 differs\n"));
}

TEST_F(StudyChanges, AStudyIsRenamed) {
  ASSERT_EQ(run_study(1).exit_code, 0);
  EXPECT_EQ(run_command({"rename", "friction", "slip"}).out, "friction is now called slip\n");
  EXPECT_EQ(run_command({"query", "slip", "--select", "point", "--format", "csv"}).out,
            "point\n0\n1\n");
  const auto unknown = run_command({"rename", "slop", "other"});
  EXPECT_EQ(unknown.exit_code, 1);
  EXPECT_THAT(unknown.err, HasSubstr("did you mean `slip`?"));
  EXPECT_EQ(run_command({"rename", "slip", std::string(500, 'x')}).exit_code, 2);
}

TEST_F(StudyChanges, AStudyIsDescribedAsAFileThatDefinesIt) {
  ASSERT_EQ(run_study(2).exit_code, 0);
  const auto described = run_command({"describe", "friction"});
  EXPECT_EQ(described.exit_code, 0) << described.err;
  std::ofstream(folder_.file("again.toml")) << described.out;
  const auto again = run_command({"run", "again.toml"});
  EXPECT_EQ(again.exit_code, 0) << "the described study is the same study and is done: "
                                << again.err;
  EXPECT_EQ(run_command({"describe", "frictoin"}).exit_code, 1);
}

TEST_F(StudyChanges, AStudyIsDeletedAfterConfirmation) {
  ASSERT_EQ(run_study(1).exit_code, 0);
  const auto unconfirmed = run_command({"delete", "friction"});
  EXPECT_EQ(unconfirmed.exit_code, 2) << "without a terminal a deletion needs --yes";
  EXPECT_THAT(unconfirmed.err, HasSubstr("--yes"));
  EXPECT_EQ(run_command({"delete", "friction", "--yes"}).out,
            "friction is deleted: 2 points, 2 results\n");
  EXPECT_THAT(run_command({"studies"}).out, Not(HasSubstr("friction")));
  EXPECT_EQ(run_command({"check"}).exit_code, 0);
  EXPECT_EQ(run_command({"delete", "friction", "--yes"}).exit_code, 1);
  EXPECT_EQ(run_study(2).exit_code, 0) << "the name is free";
}

TEST_F(StudyChanges, AChangeOfAMissingStudyFailsAndNamesTheStudy) {
  const ScriptedServer server([](const protocol::ClientRequest& request) {
    EXPECT_TRUE(request.has_status()) << "the client sent a request other than `status`";
    auto reply = reply_to(request);
    reply.mutable_status();
    return std::vector{protocol::encode(reply)};
  });
  for (const auto& words : std::vector<std::vector<std::string>>{
           {"rename", "friction", "slip", "--server", server.url()},
           {"delete", "friction", "--yes", "--server", server.url()}}) {
    const auto outcome = run_command(words);
    EXPECT_EQ(outcome.exit_code, 1) << words[0];
    EXPECT_EQ(outcome.out, "") << words[0];
    EXPECT_THAT(outcome.err, HasSubstr("no study called \"friction\" in " + server.url()));
  }
}

}  // namespace
}  // namespace oblique::client
