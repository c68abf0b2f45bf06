#include "client/trace/point_at_hand.h"

#include <stdexcept>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/model_message.h"
#include "proto/recipe/point_table.h"
#include "server/maintenance/study_changes_offline.h"

namespace oblique::client {

PointAtHand point_in(const std::string& database, const protocol::StudyStatus& study,
                     std::uint64_t point) {
  const protocol::PointTable table(server::stored_recipe(database, study.study_id()));
  if (point >= table.size()) {
    throw std::runtime_error(fmt::format("the study \"{}\" has no point {}: its points are 0 to {}",
                                         study.name(), point, table.size() - 1));
  }
  if (!table.is_left_in(point)) {
    throw std::runtime_error(
        fmt::format("point {} of the study \"{}\" is left out by its filter", point, study.name()));
  }
  if (const std::string fault = table.fault(point); !fault.empty()) {
    throw std::runtime_error(fault);
  }
  const protocol::Point values = table.point(point);
  return {study.name(), point,         table.model(values.model), values.H_m,
          values.mu,    values.e_star, table.wants_errors()};
}

PointAtHand point_of(const std::string& study, std::uint64_t point,
                     const protocol::TraceReply& reply) {
  return {study,         point,      protocol::from_message(reply.model()),
          reply.h_m(),   reply.mu(), reply.e_star(),
          reply.errors()};
}

}  // namespace oblique::client
