#pragma once

#include <cmath>
#include <cstdint>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "tests/server/web/page/page_server.h"
#include "tests/support/points.h"
#include "tests/support/recipes.h"

namespace oblique::server {

/// As `solved_point` makes it.
inline float force_of(std::uint64_t point) {
  return static_cast<float>(std::round((1.0 / 3.0 + static_cast<double>(point)) * 1e4 * 1e5) / 1e5);
}

/// A server that shows its page, and studies that a pretended worker solves.
class PageStudyTest : public testing::Test {
 protected:
  void submit(const std::string& name, const protocol::Recipe& recipe) {
    ClientRequest request;
    request.mutable_submit()->set_name(name);
    *request.mutable_submit()->mutable_recipe() = recipe;
    ASSERT_TRUE(client_.ask(request).has_submit());
  }
  void solve(std::uint64_t points, const std::set<std::uint64_t>& failing = {}) {
    PretendedWorker worker(page_.server().worker_endpoint());
    worker.fail(failing);
    worker.hello();
    worker.work(points);
  }
  /// 3 heights, 4 frictions, 2 restitutions.
  static protocol::Recipe grid_recipe() {
    return protocol::recipe_of(
        {{protocol::listed("H", {1.0, 0.9, 0.8}), protocol::range("mu", 0.0, 0.6, 4),
          protocol::listed("e", {1.0, 0.5})}});
  }
  void submit_grid() { submit("grid", grid_recipe()); }

  PageServer page_;
  PretendedClient client_{page_.server().client_endpoint()};
};

}  // namespace oblique::server
