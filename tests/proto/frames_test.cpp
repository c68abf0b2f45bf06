#include "proto/frames.h"

#include <string>

#include <gtest/gtest.h>

#include "proto/oblique.pb.h"
#include "proto/wire/frame_scan.h"
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

TEST(FramesTest, AMessageIsTheSameAfterEncodingAndDecoding) {
  const WorkerMessage sent = results_message();
  WorkerMessage received;
  ASSERT_TRUE(decode(encode(sent), received));
  EXPECT_EQ(received.kind_case(), WorkerMessage::kResults);
  EXPECT_EQ(received.SerializeAsString(), sent.SerializeAsString());
}

TEST(FramesTest, ATruncatedFrameIsNotTheWholeMessage) {
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
  // decode() refuses every truncated frame but the empty one, which is a valid message without a
  // kind.
  EXPECT_EQ(refused, static_cast<int>(frame.size()) - 1);
}

TEST(FramesTest, TextIsNoMessage) {
  WorkerMessage received;
  EXPECT_FALSE(decode("GET / HTTP/1.1\r\nHost: localhost\r\n\r\n", received));
}

TEST(FramesTest, EncodingAroundAnEncodedRecipeEqualsEncodingTheWholeMessage) {
  StudyDefinition message;
  message.set_study_id(300);
  const StudyDefinition rest = message;
  *message.mutable_recipe() =
      recipe_of({{listed("H", {1.0}), range("mu", 0.1, 1.0, 1024), listed("e", {1.0})}});
  EXPECT_EQ(encode_around(rest, StudyDefinition::kRecipeFieldNumber, encode(message.recipe())),
            encode(message));
}

TEST(FramesTest, TextThatIsNotUtf8IsRefused) {
  ClientRequest request;
  request.mutable_change()->set_study("abc");
  std::string frame = encode(request);
  frame.back() = '\xFF';
  ClientRequest received;
  EXPECT_FALSE(decode(frame, received));
}

TEST(FramesTest, TheLongestFrameIsReadAndALongerOneIsNot) {
  constexpr std::size_t kHead = 5;  // a tag of one byte and a length of four bytes
  Notice notice;
  notice.set_text(std::string(kMaxFrameBytes - kHead, 'x'));
  const std::string longest = encode(notice);
  ASSERT_EQ(longest.size(), kMaxFrameBytes);
  EXPECT_TRUE(decode(longest, notice));
  notice.set_text(std::string(kMaxFrameBytes - kHead + 1, 'x'));
  EXPECT_FALSE(decode(encode(notice), notice));
}

std::string results_of(std::size_t results) {
  WorkerMessage message;
  message.mutable_results()->set_study_id(1);
  for (std::size_t i = 0; i < results; ++i) {
    message.mutable_results()->add_results();
  }
  return encode(message);
}

ClientRequest submission() {
  ClientRequest request;
  request.set_protocol_version(kProtocolVersion);
  request.set_request_id(77);
  request.mutable_submit()->set_name("a");
  *request.mutable_submit()->mutable_recipe() = recipe_of(
      {{listed("k", {1e7}), listed("H", {1.0}), range("mu", 0.0, 0.0, 1), listed("e", {1.0})}});
  return request;
}

TEST(FrameScanTest, FramesOfCorrectWorkersPass) {
  EXPECT_TRUE(is_worker_frame_within_limits(results_of(1000)));
  EXPECT_TRUE(is_worker_frame_within_limits(""));
  WorkerMessage long_text;
  auto& result = *long_text.mutable_results()->add_results();
  result.add_texts(std::string(1 << 20, 'S'));
  EXPECT_TRUE(is_worker_frame_within_limits(encode(long_text)));
}

TEST(FrameScanTest, AMessageWithTooManyResultsIsRefused) {
  EXPECT_TRUE(is_worker_frame_within_limits(results_of(kMaxResultsAMessage)));
  EXPECT_FALSE(is_worker_frame_within_limits(results_of(kMaxResultsAMessage + 1)));
}

TEST(FrameScanTest, ALongFrameOfAWorkerIsRefusedUnlessItIsATrace) {
  EXPECT_FALSE(is_worker_frame_within_limits(std::string(kMaxWorkerFrameBytes + 1, '\xff')));
  WorkerMessage message;
  Trace& trace = *message.mutable_trace();
  trace.mutable_values()->Resize(static_cast<int>(kMaxFrameBytes / sizeof(double)) - 100'000, 1.0);
  EXPECT_TRUE(is_worker_frame_within_limits(encode(message)));
  trace.mutable_values()->Resize(static_cast<int>(kMaxFrameBytes / sizeof(double)), 1.0);
  EXPECT_FALSE(is_worker_frame_within_limits(encode(message)))
      << "the trace is longer than any frame";
  trace.clear_values();
  while (trace.ByteSizeLong() <= kMaxWorkerFrameBytes) {
    trace.mutable_result()->add_texts(std::string(100'000, 'S'));
  }
  EXPECT_FALSE(is_worker_frame_within_limits(encode(message)))
      << "only rows of a trace may make a frame so long";
}

TEST(FrameScanTest, ARecipeWithoutPaddingPasses) {
  EXPECT_TRUE(is_unpadded_request(encode(submission())));
  ClientRequest query;
  query.mutable_query()->set_sql("SELECT 1");
  EXPECT_TRUE(is_unpadded_request(encode(query)));
}

TEST(FrameScanTest, ARecipePaddedWithEmptyBlocksOrAxesIsNotRead) {
  ClientRequest blocks = submission();
  ClientRequest axes = submission();
  for (int i = 0; i < 20; ++i) {
    blocks.mutable_submit()->mutable_recipe()->add_blocks();
    axes.mutable_submit()->mutable_recipe()->mutable_blocks(0)->add_axes();
  }
  EXPECT_FALSE(is_unpadded_request(encode(blocks)));
  EXPECT_FALSE(is_unpadded_request(encode(axes)));
  EXPECT_FALSE(is_unpadded_request(std::string("\x1a\x7f", 2))) << "the frame is truncated";
}

TEST(FrameScanTest, ARecipeInAFileIsCheckedLikeOneInARequest) {
  Recipe recipe = submission().submit().recipe();
  EXPECT_TRUE(is_unpadded_recipe(recipe.SerializeAsString()));
  for (int i = 0; i < 20; ++i) {
    recipe.add_blocks();
  }
  EXPECT_FALSE(is_unpadded_recipe(recipe.SerializeAsString()));
}

TEST(FrameScanTest, TheNumberOfARequestIsReadFromItsBeginning) {
  const std::string frame = encode(submission());
  EXPECT_EQ(request_id_of(frame), 77U);
  EXPECT_EQ(request_id_of(frame.substr(0, 8)), 77U) << "the request number is in the first 8 bytes";
  EXPECT_EQ(request_id_of(""), 0U);
  EXPECT_EQ(request_id_of("\xff\xff"), 0U);
}

TEST(FrameScanTest, TruncatedAndForeignFramesAreNotReadBeyondTheirEnd) {
  const std::string frame = encode(submission());
  for (std::size_t length = 0; length <= frame.size(); ++length) {
    for (const char foreign : {'\x00', '\x0f', '\x7f', '\xff'}) {
      const std::string cut = frame.substr(0, length) + foreign;
      (void)is_unpadded_request(cut);
      (void)is_worker_frame_within_limits(cut);
      EXPECT_TRUE(request_id_of(cut) == 77U || length < 5) << length;
    }
  }
}

}  // namespace
}  // namespace oblique::protocol
