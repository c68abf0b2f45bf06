#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "proto/oblique.pb.h"
#include "server/study/study_table.h"

namespace oblique::server {

/// A parsed request of a client and, if it submits a study, the table of its recipe.
struct ReadRequest {
  bool is_readable = false;         ///< otherwise only the number counts
  std::uint64_t request_id = 0;     ///< 0: it cannot be read
  protocol::ClientRequest request;  ///< its recipe is moved into the table
  StudyTable table;                 ///< of a recipe without faults
  std::string objection;            ///< what is wrong with the recipe; empty: nothing
  bool needs_judging = false;       ///< the points of the recipe were not checked and must be
};

/// Parses one frame. Time and memory are proportional to its bytes: a long one that is padded with
/// empty messages is not parsed. With `judges` the points of a recipe are checked too
/// (PointTable::judge_points), which may take a second.
ReadRequest read_request(std::string_view frame, bool judges = true);

}  // namespace oblique::server
