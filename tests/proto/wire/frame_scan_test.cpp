#include "proto/wire/frame_scan.h"

#include <string>

#include <gtest/gtest.h>

#include "proto/frames.h"
#include "proto/oblique.pb.h"
#include "tests/support/recipes.h"

namespace oblique::protocol {
namespace {

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

TEST(FrameScanTest, WhatASoundWorkerSendsPasses) {
  EXPECT_TRUE(is_of_a_workers_size(results_of(1000)));
  EXPECT_TRUE(is_of_a_workers_size(""));
  WorkerMessage long_text;
  auto& result = *long_text.mutable_results()->add_results();
  result.add_texts(std::string(1 << 20, 'S'));
  EXPECT_TRUE(is_of_a_workers_size(encode(long_text)));
}

TEST(FrameScanTest, MoreResultsThanAMessageHoldsAreTooMany) {
  EXPECT_TRUE(is_of_a_workers_size(results_of(kMostResultsAMessage)));
  EXPECT_FALSE(is_of_a_workers_size(results_of(kMostResultsAMessage + 1)));
}

TEST(FrameScanTest, ALongFrameOfAWorkerIsRefusedButForTheRowsOfATrace) {
  EXPECT_FALSE(is_of_a_workers_size(std::string(kMaxWorkerFrameBytes + 1, '\xff')));
  WorkerMessage message;
  Trace& trace = *message.mutable_trace();
  trace.mutable_values()->Resize(static_cast<int>(kMaxFrameBytes / sizeof(double)) - 100'000, 1.0);
  EXPECT_TRUE(is_of_a_workers_size(encode(message)));
  trace.mutable_values()->Resize(static_cast<int>(kMaxFrameBytes / sizeof(double)), 1.0);
  EXPECT_FALSE(is_of_a_workers_size(encode(message))) << "longer than any frame";
  trace.clear_values();
  while (trace.ByteSizeLong() <= kMaxWorkerFrameBytes) {
    trace.mutable_result()->add_texts(std::string(100'000, 'S'));
  }
  EXPECT_FALSE(is_of_a_workers_size(encode(message))) << "these are no rows";
}

TEST(FrameScanTest, ARecipeWithRoomForItsAxesPasses) {
  EXPECT_TRUE(is_of_a_requests_shape(encode(submission())));
  ClientRequest query;
  query.mutable_query()->set_sql("SELECT 1");
  EXPECT_TRUE(is_of_a_requests_shape(encode(query)));
}

TEST(FrameScanTest, ARecipePaddedWithEmptyBlocksOrAxesIsNotRead) {
  ClientRequest blocks = submission();
  ClientRequest axes = submission();
  for (int i = 0; i < 20; ++i) {
    blocks.mutable_submit()->mutable_recipe()->add_blocks();
    axes.mutable_submit()->mutable_recipe()->mutable_blocks(0)->add_axes();
  }
  EXPECT_FALSE(is_of_a_requests_shape(encode(blocks)));
  EXPECT_FALSE(is_of_a_requests_shape(encode(axes)));
  EXPECT_FALSE(is_of_a_requests_shape(std::string("\x1a\x7f", 2))) << "cut off";
}

TEST(FrameScanTest, TheRecipeOfAFileIsJudgedAsThatOfARequest) {
  Recipe recipe = submission().submit().recipe();
  EXPECT_TRUE(is_of_a_recipes_shape(recipe.SerializeAsString()));
  for (int i = 0; i < 20; ++i) {
    recipe.add_blocks();
  }
  EXPECT_FALSE(is_of_a_recipes_shape(recipe.SerializeAsString()));
}

TEST(FrameScanTest, TheNumberOfARequestIsReadFromItsBeginning) {
  const std::string frame = encode(submission());
  EXPECT_EQ(request_id_of(frame), 77U);
  EXPECT_EQ(request_id_of(frame.substr(0, 8)), 77U) << "the rest is of no matter";
  EXPECT_EQ(request_id_of(""), 0U);
  EXPECT_EQ(request_id_of("\xff\xff"), 0U);
}

TEST(FrameScanTest, NoTruncationOrForeignByteIsReadBeyondTheEnd) {
  const std::string frame = encode(submission());
  for (std::size_t length = 0; length <= frame.size(); ++length) {
    for (const char foreign : {'\x00', '\x0f', '\x7f', '\xff'}) {
      const std::string cut = frame.substr(0, length) + foreign;
      (void)is_of_a_requests_shape(cut);
      (void)is_of_a_workers_size(cut);
      EXPECT_TRUE(request_id_of(cut) == 77U || length < 5) << length;
    }
  }
}

}  // namespace
}  // namespace oblique::protocol
