// Output of rows to files, which are written atomically.
#include <fcntl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <span>
#include <string>
#include <string_view>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/io/row_output.h"
#include "proto/wire/chunk.h"
#include "tests/support/temporary_folder.h"
#include "worker/solver/model/errors.h"

namespace oblique::client {
namespace {

constexpr std::array<std::string_view, 2> kCsvAndJson{"csv", "json"};

class RowOutputTest : public testing::Test {
 protected:
  std::string contents() const { return contents(file_); }
  std::size_t files() const {
    return static_cast<std::size_t>(
        std::distance(std::filesystem::directory_iterator(folder_.path()),
                      std::filesystem::directory_iterator()));
  }

  /// Writes one row, with the value 1 in the column `a`, to `file`.
  void write(const std::string& file, Format format = Format::kCsv) const {
    RowOutput out({.format = format, .file = file});
    out.print(row_);
    out.finish();
  }
  static std::string contents(const std::string& file) {
    std::ifstream in(file);
    return {std::istreambuf_iterator<char>(in), {}};
  }

  static protocol::QueryReply one_row() {
    protocol::ChunkWriter writer({"a"});
    writer.integer(1);
    writer.end_row();
    return writer.take();
  }
  const protocol::QueryReply row_ = one_row();
  oblique::test::TemporaryFolder folder_;
  std::string file_ = folder_.file("rows.csv");
};

TEST_F(RowOutputTest, AFileAppearsOnlyWhenItIsFinished) {
  std::ofstream(file_) << "old content";
  {
    RowOutput out({.format = Format::kCsv, .file = file_});
    out.print(row_);
  }
  EXPECT_EQ(contents(), "old content");
  EXPECT_EQ(files(), 1U);
  RowOutput out({.format = Format::kCsv, .file = file_});
  out.print(row_);
  EXPECT_EQ(contents(), "old content");
  out.finish();
  EXPECT_EQ(contents(), "a\n1\n");
  EXPECT_EQ(files(), 1U);
}

TEST_F(RowOutputTest, ALinkIsKeptAndItsTargetIsReplaced) {
  namespace fs = std::filesystem;
  const std::string link = folder_.file("link.csv");
  for (const std::string target : {"target.csv", "not there yet.csv"}) {
    fs::create_directory(folder_.file("behind"));
    const std::string path = folder_.file("behind/" + target);
    std::ofstream(folder_.file("behind/target.csv")) << "old content";
    fs::create_symlink("behind/" + target, link);
    write(link);
    EXPECT_TRUE(fs::is_symlink(link));
    EXPECT_FALSE(fs::is_symlink(path));
    EXPECT_EQ(contents(path), "a\n1\n");
    EXPECT_EQ(files(), 2U) << "expected only the link and the folder";
    fs::remove(link);
    fs::remove_all(folder_.file("behind"));
  }
}

TEST_F(RowOutputTest, ALinkToADeviceOrToItselfIsNotReplaced) {
  namespace fs = std::filesystem;
  const std::string link = folder_.file("link.csv");
  fs::create_symlink("/dev/null", link);
  write(link);
  EXPECT_EQ(fs::read_symlink(link), "/dev/null");
  const std::string circle = folder_.file("circle.csv");
  fs::create_symlink("circle.csv", circle);
  EXPECT_THROW(write(circle), solver::InputError);
}

TEST_F(RowOutputTest, AnOpenFileIsAppendedTo) {
  const int open_file = open(file_.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
  ASSERT_EQ(::write(open_file, "b\n", 2), 2);
  const std::string link = folder_.file("stdout");  // a link, like /dev/stdout
  std::filesystem::create_symlink("/proc/self/fd/" + std::to_string(open_file), link);
  write(link);
  write(link, Format::kJsonLines);
  EXPECT_EQ(contents(), "b\na\n1\n{\"a\":1}\n");
  EXPECT_TRUE(std::filesystem::is_symlink(link));
  EXPECT_EQ(files(), 2U);
  close(open_file);
}

TEST_F(RowOutputTest, AKilledProgramLeavesNoFile) {
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

TEST_F(RowOutputTest, TheFormatFollowsFromTheFlagOrTheExtension) {
  EXPECT_EQ(format_of_output("", ""), Format::kTable);
  EXPECT_EQ(format_of_output("", "/dev/null"), Format::kTable);
  EXPECT_EQ(format_of_output("", "", kCsvAndJson, Format::kCsv), Format::kCsv);
  EXPECT_EQ(format_of_output("", "a.csv/x.jsonl"), Format::kJsonLines);
  EXPECT_EQ(format_of_output("csv", "x.csv"), Format::kCsv);
  EXPECT_EQ(format_of_output("table", "x.txt"), Format::kTable);
  EXPECT_EQ(format_of_output("json", "x"), Format::kJson);
  const auto refusal = [](const std::string& flag, const std::string& file,
                          std::span<const std::string_view> allowed = format_names()) {
    try {
      format_of_output(flag, file, allowed, Format::kTable);
      return std::string();
    } catch (const solver::InputError& error) {
      return std::string(error.what());
    }
  };
  for (const char* file : {"x.txt", "x", "x.table", "x.npz"}) {
    EXPECT_THAT(refusal("", file), testing::HasSubstr(".csv, .json or .jsonl, or add"));
  }
  EXPECT_THAT(refusal("", "x.jsonl", kCsvAndJson), testing::HasSubstr(".csv or .json, or add"));
  EXPECT_THAT(refusal("jsn", ""), testing::HasSubstr("did you mean `json`?"));
  EXPECT_THAT(refusal("csv", "x.json"), testing::HasSubstr("contradict each other"));
  EXPECT_THAT(refusal("table", "x.csv"), testing::HasSubstr("contradict each other"));
}

TEST_F(RowOutputTest, AFolderOrAFileThatCannotBeCreatedIsWrongUsage) {
  EXPECT_THROW(write(folder_.path().string()), solver::InputError);
  EXPECT_THROW(write(folder_.file("no/such.csv")), solver::InputError);
}

TEST_F(RowOutputTest, AFullDiskIsAnErrorAndLeavesNoFile) {
  EXPECT_THROW(write("/dev/full"), std::runtime_error);
}

TEST_F(RowOutputTest, AClosedPipeIsNoFailure) {
  const std::string pipe = folder_.file("pipe");
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  const int reader = open(pipe.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  const auto before = std::signal(SIGPIPE, SIG_IGN);
  RowOutput out({.format = Format::kCsv, .file = pipe});
  close(reader);
  EXPECT_THROW(out.print(row_), ClosedPipe);
  std::signal(SIGPIPE, before);
}

}  // namespace
}  // namespace oblique::client
