#include "server/service/traces/traced_point.h"

#include <exception>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/model_message.h"

namespace oblique::server {

TracedPoint traced_point(const protocol::PointTable& table, std::uint64_t point) {
  TracedPoint objected;
  if (point >= table.size()) {
    objected.objection =
        fmt::format("the study has no point {}: its points are 0 to {}", point, table.size() - 1);
    return objected;
  }
  objected.objection = table.is_left_in(point)
                           ? table.fault(point)
                           : fmt::format("point {} is left out by the study's filter", point);
  if (!objected.objection.empty()) {
    return objected;
  }
  const protocol::Point values = table.point(point);
  return {protocol::to_message(table.model(values.model)),
          values.H_m,
          values.mu,
          values.e_star,
          table.wants_errors(),
          {}};
}

protocol::TraceReply said_of(const TracedPoint& point) {
  protocol::TraceReply reply;
  *reply.mutable_model() = point.model;
  reply.set_h_m(point.H_m);
  reply.set_mu(point.mu);
  reply.set_e_star(point.e_star);
  reply.set_errors(point.errors);
  return reply;
}

TracedPoint traced_point(const std::string& recipe_bytes, std::uint64_t point) {
  TracedPoint traced;
  protocol::Recipe recipe;
  if (!recipe.ParseFromString(recipe_bytes)) {
    traced.objection = "the bytes of its study are damaged";
    return traced;
  }
  try {
    return traced_point(protocol::PointTable(std::move(recipe)), point);
  } catch (const std::exception& error) {
    traced.objection = error.what();
    return traced;
  }
}

}  // namespace oblique::server
