#include "proto/frames.h"

#include <string>
#include <vector>

#include <google/protobuf/empty.pb.h>
#include <gtest/gtest.h>

#include "proto/oblique.pb.h"
#include "proto/recipe/model_message.h"
#include "proto/recipe/point_table.h"
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

/// Returns a field as it is encoded: a tag, and `value`.
std::string encoded_field(int number, int wire_type, const std::string& value) {
  std::string field;
  for (auto tag = static_cast<unsigned>(number << 3 | wire_type); tag != 0; tag >>= 7U) {
    field += static_cast<char>((tag & 0x7fU) | (tag >= 0x80U ? 0x80U : 0U));
  }
  return field + value;
}

/// Adds the path to each field of `type` and of its parts, and to one unknown field of each.
void add_paths(const google::protobuf::Descriptor& type, const std::vector<int>& outer,
               std::vector<std::vector<int>>& paths) {
  constexpr int kUnknown = 15;
  std::vector<int> numbers{kUnknown};
  for (int i = 0; i < type.field_count(); ++i) {
    numbers.push_back(type.field(i)->number());
  }
  for (const int number : numbers) {
    std::vector<int> path = outer;
    path.push_back(number);
    paths.push_back(path);
    const auto* field = type.FindFieldByNumber(number);
    if (field != nullptr && field->message_type() != nullptr) {
      add_paths(*field->message_type(), path, paths);
    }
  }
}

/// Expects that a frame with very many smallest values in any one field is either refused or needs
/// at most `most_bytes(path)` when it is parsed.
template <class Message, class IsWithinLimits, class MostBytes>
void expect_bounded_memory(const IsWithinLimits& is_within_limits, const MostBytes& most_bytes) {
  constexpr int kValues = 100'000;
  std::vector<std::vector<int>> paths;
  add_paths(*Message::descriptor(), {}, paths);
  int refused = 0;
  for (const std::vector<int>& path : paths) {
    const int number = path.back();
    for (const std::string& value : {encoded_field(number, 0, std::string(1, '\0')),
                                     encoded_field(number, 2, std::string(1, '\0')),
                                     encoded_field(number, 3, encoded_field(number, 4, ""))}) {
      std::string frame;
      for (int i = 0; i < kValues; ++i) {
        frame += value;
      }
      for (std::size_t i = path.size() - 1; i-- > 0;) {
        frame = encode_around(google::protobuf::Empty(), path[i], frame);
      }
      for (const bool is_cut : {false, true}) {
        if (is_cut) {
          frame.pop_back();
        }
        Message message;
        if (is_within_limits(frame)) {
          (void)decode(frame, message);
        } else {
          ++refused;
        }
        EXPECT_LE(message.SpaceUsedLong(), most_bytes(path)) << testing::PrintToString(path);
      }
    }
  }
  EXPECT_GT(refused, 0);
}

TEST(FrameScanTest, NoFieldOfARequestCanTakeMoreMemoryThanIsAllowed) {
  expect_bounded_memory<ClientRequest>(is_request_within_limits, [](const std::vector<int>& path) {
    return path.front() == ClientRequest::kSubmitFieldNumber ? kMaxParsedRecipeBytes
                                                             : kMaxParsedRequestBytes;
  });
}

TEST(FrameScanTest, NoFieldOfAWorkersMessageCanTakeMoreMemoryThanIsAllowed) {
  expect_bounded_memory<WorkerMessage>(is_worker_frame_within_limits, [](const std::vector<int>&) {
    return kMaxParsedWorkerFrameBytes;
  });
}

TEST(FrameScanTest, ManyEmptyTextsInAQueryOrResultAreNotParsed) {
  ClientRequest request;
  WorkerMessage message;
  PointResult& result = *message.mutable_results()->add_results();
  for (int i = 0; i < 2'000'000; ++i) {
    request.mutable_query()->mutable_question()->add_select("");
    result.add_texts("");
  }
  EXPECT_FALSE(is_request_within_limits(encode(request)));
  EXPECT_LT(encode(message).size(), kMaxWorkerFrameBytes + 1000);
  EXPECT_FALSE(is_worker_frame_within_limits(encode(message)));
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

TEST(FrameScanTest, TheLargestRequestsOfCorrectClientsPass) {
  EXPECT_TRUE(is_request_within_limits(encode(submission())));
  ClientRequest query;
  query.mutable_query()->set_sql(std::string(1'000'000, 'x'));
  EXPECT_TRUE(is_request_within_limits(encode(query)));
  ClientRequest list = submission();
  list.mutable_submit()
      ->mutable_recipe()
      ->mutable_blocks(0)
      ->mutable_axes(0)
      ->mutable_values()
      ->Resize(2'000'000, 1.5);
  EXPECT_TRUE(is_request_within_limits(encode(list)));
  ClientRequest blocks = submission();
  const Recipe recipe = blocks.submit().recipe();
  for (std::size_t i = 1; i < kMaxBlocks; ++i) {
    *blocks.mutable_submit()->mutable_recipe()->add_blocks() = recipe.blocks(0);
  }
  EXPECT_TRUE(is_request_within_limits(encode(blocks)));
}

TEST(FrameScanTest, ARecipePaddedWithEmptyBlocksOrAxesIsNotParsed) {
  ClientRequest blocks = submission();
  ClientRequest axes = submission();
  for (int i = 0; i < 250'000; ++i) {
    blocks.mutable_submit()->mutable_recipe()->add_blocks();
    axes.mutable_submit()->mutable_recipe()->mutable_blocks(0)->add_axes();
  }
  for (const ClientRequest& padded : {blocks, axes}) {
    EXPECT_FALSE(is_request_within_limits(encode(padded)));
    Recipe recipe;
    EXPECT_FALSE(parse_recipe(padded.submit().recipe().SerializeAsString(), recipe));
  }
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
      (void)is_request_within_limits(cut);
      (void)is_worker_frame_within_limits(cut);
      EXPECT_TRUE(request_id_of(cut) == 77U || length < 5) << length;
    }
  }
}

}  // namespace
}  // namespace oblique::protocol
