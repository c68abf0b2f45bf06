// Where rows go: files that appear when they are whole.
#include <fcntl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/formats/row_output.h"
#include "tests/client/formats/rows_of_tests.h"
#include "tests/support/temporary_folder.h"
#include "worker/solver/model/errors.h"

namespace oblique::client {
namespace {

class RowOutputTest : public testing::Test {
 protected:
  std::string contents() const {
    std::ifstream in(file_);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  std::size_t files() const {
    return static_cast<std::size_t>(
        std::distance(std::filesystem::directory_iterator(folder_.path()),
                      std::filesystem::directory_iterator()));
  }

  const protocol::QueryReply row_ = test::chunk_of({"a"}, {{std::int64_t{1}}});
  oblique::test::TemporaryFolder folder_;
  std::string file_ = folder_.file("rows.csv");
};

TEST_F(RowOutputTest, AFileAppearsWhenItIsFinishedOnly) {
  std::ofstream(file_) << "of before";
  {
    RowOutput out({.format = Format::kCsv, .file = file_});
    out.print(row_);
  }
  EXPECT_EQ(contents(), "of before");
  EXPECT_EQ(files(), 1U);
  RowOutput out({.format = Format::kCsv, .file = file_});
  out.print(row_);
  EXPECT_EQ(contents(), "of before");
  out.finish();
  EXPECT_EQ(contents(), "a\n1\n");
  EXPECT_EQ(files(), 1U);
}

TEST_F(RowOutputTest, ALinkStaysAndWhatItLeadsToIsTheFile) {
  namespace fs = std::filesystem;
  const std::string link = folder_.file("link.csv");
  for (const std::string target : {"target.csv", "not there yet.csv"}) {
    fs::create_directory(folder_.file("behind"));
    const std::string path = folder_.file("behind/" + target);
    std::ofstream(folder_.file("behind/target.csv")) << "of before";
    fs::create_symlink("behind/" + target, link);
    RowOutput out({.format = Format::kCsv, .file = link});
    out.print(row_);
    out.finish();
    EXPECT_TRUE(fs::is_symlink(link));
    EXPECT_FALSE(fs::is_symlink(path));
    std::ifstream written(path);
    EXPECT_EQ(std::string(std::istreambuf_iterator<char>(written), {}), "a\n1\n");
    EXPECT_EQ(files(), 2U) << "the link and the folder";
    fs::remove(link);
    fs::remove_all(folder_.file("behind"));
  }
}

TEST_F(RowOutputTest, ALinkToADeviceOrInACircleIsNotReplaced) {
  namespace fs = std::filesystem;
  const std::string link = folder_.file("link.csv");
  fs::create_symlink("/dev/null", link);
  RowOutput out({.format = Format::kCsv, .file = link});
  out.print(row_);
  out.finish();
  EXPECT_EQ(fs::read_symlink(link), "/dev/null");
  const std::string circle = folder_.file("circle.csv");
  fs::create_symlink("circle.csv", circle);
  EXPECT_THROW(RowOutput({.format = Format::kCsv, .file = circle}), solver::InputError);
}

TEST_F(RowOutputTest, WhatIsOpenAlreadyIsWrittenBehindWhatStandsThere) {
  const int open_file = open(file_.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
  ASSERT_EQ(write(open_file, "b\n", 2), 2);
  const std::string link = folder_.file("stdout");  // as /dev/stdout is one
  std::filesystem::create_symlink("/proc/self/fd/" + std::to_string(open_file), link);
  for (const Format format : {Format::kCsv, Format::kJsonLines}) {
    RowOutput out({.format = format, .file = link});
    out.print(row_);
    out.finish();
  }
  EXPECT_EQ(contents(), "b\na\n1\n{\"a\":1}\n");
  EXPECT_TRUE(std::filesystem::is_symlink(link));
  EXPECT_EQ(files(), 2U);
  close(open_file);
}

TEST_F(RowOutputTest, NothingIsLeftOfAFileWhoseProgramIsKilled) {
  const pid_t child = fork();
  if (child == 0) {
    RowOutput out({.format = Format::kCsv, .file = file_});
    out.print(row_);
    raise(SIGKILL);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFSIGNALED(status));
  EXPECT_EQ(files(), 0U);
}

TEST_F(RowOutputTest, TheFormatIsWhatTheEndOfTheNameSays) {
  EXPECT_EQ(format_of_output("", ""), Format::kTable);
  EXPECT_EQ(format_of_output("", "/dev/null"), Format::kTable);
  EXPECT_EQ(format_of_output("", "x.csv"), Format::kCsv);
  EXPECT_EQ(format_of_output("", "a.csv/x.jsonl"), Format::kJsonLines);
  EXPECT_EQ(format_of_output("csv", "x.csv"), Format::kCsv);
  EXPECT_EQ(format_of_output("table", "x.txt"), Format::kTable);
  EXPECT_EQ(format_of_output("json", "x"), Format::kJson);
  for (const auto& [flag, file] :
       {std::pair{"", "x.txt"}, {"", "x"}, {"", "x.table"}, {"", "x.npz"}}) {
    try {
      format_of_output(flag, file);
      ADD_FAILURE() << file;
    } catch (const solver::InputError& error) {
      EXPECT_THAT(error.what(), testing::HasSubstr(".csv, .json or .jsonl"));
    }
  }
  EXPECT_THROW(format_of_output("csv", "x.json"), solver::InputError);
  EXPECT_THROW(format_of_output("table", "x.csv"), solver::InputError);
}

TEST_F(RowOutputTest, AFolderOrAFileThatCannotBeMadeIsWrongUsage) {
  const auto output_to = [](const std::string& file) {
    RowOutput out({.format = Format::kCsv, .file = file});
  };
  EXPECT_THROW(output_to(folder_.path().string()), solver::InputError);
  EXPECT_THROW(output_to(folder_.file("no/such.csv")), solver::InputError);
}

TEST_F(RowOutputTest, ADeviceIsWrittenInPlace) {
  RowOutput out({.format = Format::kCsv, .file = "/dev/null"});
  out.print(row_);
  out.finish();
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/null"));
}

TEST_F(RowOutputTest, AFullDiskIsAnErrorAndNoFile) {
  RowOutput out({.format = Format::kCsv, .file = "/dev/full"});
  out.print(row_);
  EXPECT_THROW(out.finish(), std::runtime_error);
}

TEST_F(RowOutputTest, APipeThatNobodyReadsIsNoFailureWithWordsOfItsOwn) {
  const std::string pipe = folder_.file("pipe");
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  const int reader = open(pipe.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  const auto before = std::signal(SIGPIPE, SIG_IGN);
  RowOutput out({.format = Format::kCsv, .file = pipe});
  close(reader);
  out.print(row_);
  EXPECT_THROW(out.finish(), ClosedPipe);
  std::signal(SIGPIPE, before);
}

}  // namespace
}  // namespace oblique::client
