// Archives for NumPy, read back by NumPy.
#include <fstream>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/formats/zip_writer.h"
#include "tests/client/formats/rows_of_tests.h"
#include "tests/support/python.h"
#include "worker/solver/model/errors.h"

namespace oblique::client {
namespace {

using test::chunk_of;
using test::printed;

class Npz : public testing::Test {
 protected:
  /// What one prints who has loaded the archive of these chunks as `a`.
  std::string of(const std::vector<protocol::QueryReply>& chunks, const std::string& program) {
    std::ofstream(folder_.file("a.npz"), std::ios::binary) << printed(Format::kNpz, chunks);
    return oblique::test::said_by_python(folder_,
                                         "import numpy\nimport zipfile\na = numpy.load('a.npz')\n"
                                         "assert zipfile.ZipFile('a.npz').testzip() is None\n" +
                                             program);
  }

  oblique::test::TemporaryFolder folder_;
};

TEST_F(Npz, HasAnArrayAColumnOfTheKindOfItsValues) {
  const auto rows =
      chunk_of({"point", "fn_N", "mode", "none"}, {{std::int64_t{1}, 0.1, "SC SR", nullptr},
                                                   {std::int64_t{-2}, 1e300, "µ", nullptr},
                                                   {std::int64_t{3}, nullptr, nullptr, nullptr}});
  EXPECT_EQ(of({rows},
               "print(a.files)\n"
               "for name in a.files: print(a[name].dtype.str, a[name].tolist())"),
            "['point', 'fn_N', 'mode', 'none']\n"
            "<i8 [1, -2, 3]\n"
            "<f8 [0.1, 1e+300, nan]\n"
            "<U5 ['SC SR', 'µ', '']\n"
            "<f8 [nan, nan, nan]\n");
}

TEST_F(Npz, ChangesTheKindOfAColumnWithTheFirstValueThatNeedsIt) {
  const auto ints = chunk_of({"a", "b", "c"}, {{std::int64_t{1}, std::int64_t{1}, 2.5},
                                               {std::int64_t{2}, std::int64_t{2}, nullptr}});
  const auto others = chunk_of({"a", "b", "c"}, {{nullptr, "x", "y"}});
  EXPECT_EQ(
      of({ints, others, ints}, "for name in a.files: print(a[name].dtype.str, a[name].tolist())"),
      "<f8 [1.0, 2.0, nan, 1.0, 2.0]\n"
      "<U1 ['1', '2', 'x', '1', '2']\n"
      "<U3 ['2.5', '', 'y', '2.5', '']\n");
}

TEST_F(Npz, NamesItsArraysSoThatEveryoneCanReadAndUnpackThem) {
  const std::string longest(70'000, 'x');
  const auto rows =
      chunk_of({longest + "1", longest + "2", "a/b", "../c", std::string("d\0e", 3), "..", "a_b",
                "\xc2\xb5/2"},
               {{std::int64_t{1}, std::int64_t{2}, std::int64_t{3}, std::int64_t{4},
                 std::int64_t{5}, std::int64_t{6}, std::int64_t{7}, std::int64_t{8}}});
  EXPECT_EQ(
      of({rows}, "for name in a.files: print(name.replace('x' * 200, '200x'), a[name].tolist())"),
      "200x [1]\n"
      "200x_2 [2]\n"
      "a_b_2 [3]\n"
      ".._c [4]\n"
      "d_x00e [5]\n"
      ".._ [6]\n"
      "a_b [7]\n"
      "\xc2\xb5_2 [8]\n");
}

TEST_F(Npz, OfManyRowsHasThemAll) {
  std::vector<protocol::QueryReply> chunks;
  for (std::int64_t part = 0; part < 20; ++part) {
    test::TestRows rows;
    for (std::int64_t i = 0; i < 1000; ++i) {
      rows.push_back({part * 1000 + i, std::string(static_cast<std::size_t>(i % 7), 'x')});
    }
    chunks.push_back(chunk_of({"n", "text"}, rows));
  }
  EXPECT_EQ(
      of(chunks, "print((a['n'] == numpy.arange(20000)).all(), len(a['text']), a['text'][19996])"),
      "True 20000 xx\n");
}

TEST_F(Npz, OfNoRowsAndOfEqualNamesIsRead) {
  EXPECT_EQ(of({chunk_of({"a", "a"}, {})}, "print(a.files, a['a'].shape)"), "['a', 'a_2'] (0,)\n");
}

TEST_F(Npz, OfNoValuesHasColumnsOfTheirUsualKind) {
  using enum protocol::CellKind;
  const auto archive = [&](const test::TestRows& rows) {
    std::ofstream(folder_.file("a.npz"), std::ios::binary)
        << printed(Format::kNpz, {chunk_of({"status", "study_id", "mu", "new"}, rows)},
                   {.usual = {kText, kInteger, kReal}});
    return oblique::test::said_by_python(
        folder_,
        "import numpy\na = numpy.load('a.npz')\n"
        "for name in a.files: print(a[name].dtype.kind, a[name].tolist())");
  };
  EXPECT_EQ(archive({}), "U []\ni []\nf []\nf []\n");
  EXPECT_EQ(archive({{nullptr, nullptr, nullptr, nullptr}}), "U ['']\nf [nan]\nf [nan]\nf [nan]\n");
}

TEST_F(Npz, TakesTextsThatAreNotUtf8) {
  EXPECT_EQ(of({chunk_of({"a"}, {{"x\xff"}})}, "print(ascii(a['a'][0]))"), "'x\\ufffd'\n");
}

TEST(NpzTexts, ThatAreTooLongForAnArrayAreRefused) {
  EXPECT_THROW(printed(Format::kNpz, {chunk_of({"a"}, {{std::string(200'000, 'x')}})}),
               solver::InputError);
}

/// Counts what is written and keeps its end.
class EndOfArchive : public Sink {
 public:
  std::uint64_t bytes = 0;
  std::string end;

 protected:
  void write(std::string_view part) override {
    bytes += part.size();
    end = (end + std::string(part))
              .substr(end.size() + part.size() > 1000 ? end.size() + part.size() - 1000 : 0);
  }
};

TEST(ZipWriter, WritesMembersOfMoreThanFourGigabytes) {
  // Sizes are what it is told: nobody appends so much here.
  EndOfArchive sink;
  ZipWriter archive(sink);
  constexpr std::uint64_t kHuge = (std::uint64_t{1} << 32U) + 5;
  archive.begin("a.npy", kHuge, 0);
  archive.end();
  sink.finish();
  std::string huge;
  for (unsigned i = 0; i < 8; ++i) {
    huge += static_cast<char>((kHuge >> (8 * i)) & 0xffU);
  }
  EXPECT_THAT(sink.end, testing::HasSubstr(huge + huge));
}

}  // namespace
}  // namespace oblique::client
