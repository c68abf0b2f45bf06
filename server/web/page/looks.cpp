#include "server/web/page/looks.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include <google/protobuf/util/json_util.h>
#include <spdlog/fmt/fmt.h>

#include "proto/recipe/point_table.h"
#include "proto/recipe/sha256.h"
#include "proto/recipe/written/study_terms.h"
#include "server/web/http/json_answer.h"
#include "worker/solver/model/errors.h"

namespace oblique::server {
namespace {

using protocol::ClientReply;
using protocol::ClientRequest;

constexpr std::string_view kLookName = "look-";
constexpr std::size_t kDigits = 16;
constexpr auto kFirstOfAll = static_cast<std::int32_t>(protocol::kHighestPriority);

std::string name_of(const protocol::Recipe& recipe) {
  protocol::Sha256 hash;
  hash.add(recipe.SerializeAsString());
  return std::string(kLookName) + protocol::hexadecimal(hash.digest()).substr(0, kDigits);
}

bool is_leaving(const protocol::StudyStatus& study) {
  const std::string& name = study.name();
  return name.starts_with(kLookName) && name.size() == kLookName.size() + kDigits &&
         name.find_first_not_of("0123456789abcdef", kLookName.size()) == std::string::npos &&
         study.priority() == kFirstOfAll && study.submitted_by().empty();
}

std::uint64_t points_of_look(const protocol::Recipe& recipe) {
  try {
    return protocol::PointTable(recipe).size();
  } catch (const solver::InputError& error) {
    throw std::invalid_argument(error.what());
  }
}

}  // namespace

Talk Looks::begin(const HttpQuestion& question) {
  protocol::SubmitRequest asked;
  const auto read = google::protobuf::util::JsonStringToMessage(question.body, &asked);
  if (!read.ok()) {
    throw std::invalid_argument("the body is no study: " + std::string(read.message()));
  }
  if (const std::uint64_t points = points_of_look(asked.recipe()); points > kMostPoints) {
    throw std::invalid_argument(fmt::format(
        "that has {} points; {} are looked at together at most: ask for fewer, or submit it",
        points, kMostPoints));
  }
  asked.set_name(name_of(asked.recipe()));
  asked.set_priority(kFirstOfAll);
  ClientRequest request;
  *request.mutable_submit() = asked;
  return {request,
          [this, asked](const ClientReply& reply) -> Talk::Next {
            const protocol::SubmitReply& said = reply.submit();
            add(said.study_id(), asked);
            return json_answer({{"id", said.study_id()},
                                {"name", asked.name()},
                                {"points", said.points()},
                                {"settled", said.settled()}});
          },
          too_slow(),
          {},
          true};
}

std::optional<Talk> Looks::keep(std::uint64_t study, const HttpQuestion& question) {
  const auto look = looks_.find(study);
  if (look == looks_.end() || look->second.going) {
    return std::nullopt;
  }
  const auto body = nlohmann::json::parse(question.body, nullptr, false);
  if (!body.is_object() || !body.contains("name") || !body["name"].is_string()) {
    throw std::invalid_argument("the body must be {\"name\": NAME}");
  }
  protocol::SubmitRequest kept = look->second.request;
  ClientRequest request;
  request.mutable_change()->set_study(kept.name());
  request.mutable_change()->set_study_id(study);
  request.mutable_change()->set_change(protocol::STUDY_CHANGE_RENAME);
  request.mutable_change()->set_new_name(body["name"]);
  kept.set_name(body["name"]);
  kept.set_priority(0);
  look->second.seen = Clock::now();
  return Talk{request,
              [this, study, kept](const ClientReply& reply) mutable -> Talk::Next {
                if (reply.has_submit()) {
                  return json_answer({{"id", study}, {"name", kept.name()}});
                }
                looks_.erase(study);
                ClientRequest next;
                if (reply.has_describe()) {
                  *kept.mutable_recipe() = reply.describe().recipe();
                } else if (!kept.has_recipe()) {  // an earlier server made it
                  next.mutable_describe()->set_study(kept.name());
                  return next;
                }
                *next.mutable_submit() = kept;
                return next;
              },
              too_slow(),
              {},
              true};
}

void Looks::add(std::uint64_t study, const protocol::SubmitRequest& request) {
  // One that had the name before was deleted or renamed by somebody else.
  std::erase_if(looks_, [&](const auto& look) {
    return look.first != study && look.second.request.name() == request.name();
  });
  looks_.insert_or_assign(study, Look{request, Clock::now()});
  while (std::count_if(looks_.begin(), looks_.end(), [](const auto& look) {
           return !look.second.going;
         }) > static_cast<std::ptrdiff_t>(kMost)) {
    const auto is_older = [](const auto& one, const auto& other) {
      return !one.second.going && (other.second.going || one.second.seen < other.second.seen);
    };
    const auto oldest = std::min_element(looks_.begin(), looks_.end(), is_older);
    drop(oldest->second);
  }
}

void Looks::seen(std::uint64_t study) {
  if (const auto look = looks_.find(study); look != looks_.end()) {
    look->second.seen = Clock::now();
  }
}

void Looks::drop(Look& look) {
  ClientRequest request;
  // By its name alone: under another one somebody keeps it.
  request.mutable_change()->set_study(look.request.name());
  request.mutable_change()->set_change(protocol::STUDY_CHANGE_DELETE);
  look.going = ++last_number_;
  service_.ask(*look.going, std::move(request));
}

/// Those of an earlier server; somebody may still look at them.
void Looks::find_leavings() {
  if (!std::exchange(has_searched_, true)) {
    searching_ = ++last_number_;
    service_.ask(*searching_, status_of_all(0));
  }
  const auto reply = searching_ ? service_.reply(*searching_) : std::nullopt;
  if (!reply) {
    return;
  }
  service_.forget(*std::exchange(searching_, std::nullopt));
  for (const auto& study : reply->status().studies()) {
    if (is_leaving(study) && !looks_.contains(study.study_id())) {
      protocol::SubmitRequest request;
      request.set_name(study.name());
      looks_.emplace(study.study_id(), Look{request, Clock::now()});
    }
  }
  if (reply->status().next_after() != 0) {
    searching_ = ++last_number_;
    service_.ask(*searching_, status_of_all(reply->status().next_after()));
  }
}

std::optional<std::chrono::milliseconds> Looks::tick() {
  find_leavings();
  const auto now = Clock::now();
  for (auto look = looks_.begin(); look != looks_.end();) {
    Look& state = look->second;
    const auto reply = state.going ? service_.reply(*state.going) : std::nullopt;
    if (reply) {
      service_.forget(*std::exchange(state.going, std::nullopt));
    }
    // One that was deleted by somebody else is gone too.
    const bool is_gone =
        reply && (reply->has_change() || reply->error().message().starts_with("there is no study"));
    if (is_gone) {
      look = looks_.erase(look);
      continue;
    }
    if (reply) {
      state.seen = now;  // it is tried again
    } else if (!state.going && now - state.seen >= kept_) {
      drop(state);
    }
    ++look;
  }
  return looks_.empty() && !searching_ ? std::nullopt : std::optional(kept_ / 10);
}

}  // namespace oblique::server
