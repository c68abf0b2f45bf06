// Where rows go: files that appear when they are whole.
#include <fcntl.h>
#include <sys/stat.h>
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

TEST_F(RowOutputTest, ArchivesLeaveNoFilesOfTheirColumns) {
  file_ = folder_.file("rows.npz");
  RowOutput out({.format = Format::kNpz, .file = file_});
  out.print(row_);
  out.finish();
  EXPECT_GT(std::filesystem::file_size(file_), 100U);
  EXPECT_EQ(files(), 1U) << "columns are kept in files without a name";
}

}  // namespace
}  // namespace oblique::client
