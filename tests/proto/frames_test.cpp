#include "proto/frames.h"

#include <string>

#include <gtest/gtest.h>

#include "proto/oblique.pb.h"
#include "tests/support/recipes.h"

namespace oblique::protocol {
namespace {

WorkerMessage results_message() {
  WorkerMessage message;
  Results& results = *message.mutable_results();
  results.set_study_id(3);
  results.set_lease_id(99);
  results.set_sequence(7);
  for (int i = 0; i < 10; ++i) {
    PointResult& result = *results.add_results();
    result.set_point(static_cast<std::uint64_t>(i));
    result.add_texts("SC SR sR sC sR");
    result.add_peaks(1.5);
  }
  return message;
}

TEST(FramesTest, AMessageComesBackFromItsFrame) {
  const WorkerMessage sent = results_message();
  WorkerMessage received;
  ASSERT_TRUE(decode(encode(sent), received));
  EXPECT_EQ(received.kind_case(), WorkerMessage::kResults);
  EXPECT_EQ(received.SerializeAsString(), sent.SerializeAsString());
}

TEST(FramesTest, ATruncatedFrameIsNeverTakenForTheWholeMessage) {
  const std::string frame = encode(results_message());
  int refused = 0;
  for (std::size_t length = 0; length < frame.size(); ++length) {
    WorkerMessage received;
    if (!decode(std::string_view(frame).substr(0, length), received)) {
      ++refused;
    } else {
      EXPECT_NE(received.kind_case(), WorkerMessage::kResults) << length << " bytes";
    }
  }
  // Only the empty frame is a message, one without a kind.
  EXPECT_EQ(refused, static_cast<int>(frame.size()) - 1);
}

TEST(FramesTest, TextIsForeign) {
  WorkerMessage received;
  EXPECT_FALSE(decode("GET / HTTP/1.1\r\nHost: localhost\r\n\r\n", received));
}

TEST(FramesTest, AMessageOfAnotherVersionWithOnlyUnknownFieldsHasNoKind) {
  // Field 100, a varint of 1: what a later version might send.
  const std::string later("\xA0\x06\x01", 3);
  ServerToWorker received;
  EXPECT_TRUE(decode(later, received));
  EXPECT_EQ(received.kind_case(), ServerToWorker::KIND_NOT_SET);
}

TEST(FramesTest, AFrameLongerThanAllowedIsRefusedAndTheLongestTaken) {
  ClientRequest request;
  request.mutable_query()->set_sql(std::string(kMaxFrameBytes - 100, 'x'));
  std::string frame = encode(request);
  ASSERT_LT(frame.size(), kMaxFrameBytes);
  ClientRequest received;
  EXPECT_TRUE(decode(frame, received));
  request.mutable_query()->mutable_sql()->append(200, 'x');
  frame = encode(request);
  ASSERT_GT(frame.size(), kMaxFrameBytes);
  EXPECT_FALSE(decode(frame, received));
}

TEST(FramesTest, ADefinitionAroundAnEncodedRecipeIsThatOfTheRecipe) {
  ServerToWorker message;
  message.mutable_study()->set_study_id(300);
  *message.mutable_study()->mutable_recipe() =
      recipe_of({{listed("H", {1.0}), range("mu", 0.1, 1.0, 1024), listed("e", {1.0})}});
  EXPECT_EQ(definition_around(300, encode(message.study().recipe())), encode(message));
}

TEST(FramesTest, TextThatIsNotUtf8IsRefused) {
  ClientRequest request;
  request.mutable_change()->set_study("abc");
  std::string frame = encode(request);
  frame.back() = '\xFF';
  ClientRequest received;
  EXPECT_FALSE(decode(frame, received));
}

TEST(FramesTest, TheLongestFrameIsReadAndNoLongerOne) {
  constexpr std::size_t kHead = 5;  // a tag, and a length of four bytes
  Notice notice;
  notice.set_text(std::string(kMaxFrameBytes - kHead, 'x'));
  const std::string longest = encode(notice);
  ASSERT_EQ(longest.size(), kMaxFrameBytes);
  EXPECT_TRUE(decode(longest, notice));
  notice.set_text(std::string(kMaxFrameBytes - kHead + 1, 'x'));
  EXPECT_FALSE(decode(encode(notice), notice));
}

}  // namespace
}  // namespace oblique::protocol
