#include "server/service/request_check.h"

#include <memory>
#include <utility>

#include "proto/frames.h"
#include "proto/recipe/checks.h"
#include "proto/wire/frame_scan.h"

namespace oblique::server {

ReadRequest read_request(std::string_view frame, bool judges) {
  // Padding cannot make much of a shorter frame.
  constexpr std::size_t kScannedAbove = std::size_t{64} * 1024;
  ReadRequest read;
  read.is_readable = (frame.size() <= kScannedAbove || protocol::is_of_a_requests_shape(frame)) &&
                     protocol::decode(frame, read.request);
  read.request_id = read.is_readable ? read.request.request_id() : protocol::request_id_of(frame);
  if (!read.is_readable || !read.request.has_submit()) {
    return read;
  }
  try {
    protocol::Recipe& recipe = *read.request.mutable_submit()->mutable_recipe();
    protocol::check_size(recipe);
    auto table = std::make_shared<const protocol::PointTable>(std::move(recipe));
    read.needs_judging = table->needs_judging() && !judges;
    if (judges) {
      table->judge_points();
    }
    read.table = std::move(table);
  } catch (const solver::InputError& error) {
    read.objection = error.what();
  }
  read.request.mutable_submit()->clear_recipe();
  return read;
}

}  // namespace oblique::server
