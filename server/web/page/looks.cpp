#include "server/web/page/looks.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/model_message.h"
#include "proto/recipe/point_table.h"
#include "proto/recipe/written.h"
#include "server/web/answers/study_answers.h"
#include "server/web/http/json_answer.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"
#include "worker/solver/model/parameters.h"

namespace oblique::server {
namespace {

using protocol::ClientReply;
using protocol::ClientRequest;

constexpr unsigned kItHasGone = 404;
constexpr unsigned kKeptAlready = 409;
constexpr std::string_view kLookName = "look-";
constexpr std::size_t kDigits = 16;
constexpr auto kFirstOfAll = static_cast<std::int32_t>(protocol::kHighestPriority);

std::string name_of(const protocol::Recipe& recipe) {
  return std::string(kLookName) +
         protocol::sha256_of(recipe.SerializeAsString()).substr(0, kDigits);
}

bool is_leaving(const protocol::StudyStatus& study) {
  const std::string& name = study.name();
  return name.starts_with(kLookName) && name.size() == kLookName.size() + kDigits &&
         name.find_first_not_of("0123456789abcdef", kLookName.size()) == std::string::npos &&
         study.priority() == kFirstOfAll && study.submitted_by().empty();
}

std::string kept_as(const std::string& name) {
  return fmt::format("that is kept as \"{}\" already", name);
}

/// What is said to who keeps a study once more.
Talk kept_already(std::uint64_t study, const std::string& name) {
  return {status_of_number(study),
          [study, name](const ClientReply& reply) -> Talk::Next {
            if (reply.status().studies_size() != 1) {
              return no_such_study();
            }
            const std::string& now = reply.status().studies(0).name();
            return now == name ? json_answer({{"id", study}, {"name", name}})
                               : error_answer(kKeptAlready, kept_as(now));
          },
          too_slow()};
}

/// A point under way is not interrupted, and what is looked at comes before all else: models whose
/// points may take minutes are for studies.
void judge_cost(const solver::ModelParameters& model) {
  constexpr std::size_t kMostElements = 256;
  constexpr double kLeastTolerance = 1e-8;
  constexpr double kShortestStep_s = 1e-9;
  constexpr double kShortestStepOfFall_s = 1e-7;
  const auto elements = model.lengths_m.size() * static_cast<std::size_t>(model.elements_per_link);
  if (elements > kMostElements) {
    throw std::invalid_argument(
        fmt::format("that has {} elements (links times elements_per_link), and {} at most are "
                    "solved while one looks: submit it as a study",
                    elements, kMostElements));
  }
  const auto is_below = [](double step_s, double least_s) {
    return step_s > 0.0 && step_s < least_s;
  };
  if (model.tolerance < kLeastTolerance || is_below(model.dt_s, kShortestStep_s) ||
      is_below(model.dt_fall_s, kShortestStepOfFall_s)) {
    throw std::invalid_argument(fmt::format(
        "what is solved while one looks has a tolerance of {}, a dt of {} s and a dt_fall of {} s "
        "at least: submit it as a study",
        solver::exact_number(kLeastTolerance), solver::exact_number(kShortestStep_s),
        solver::exact_number(kShortestStepOfFall_s)));
  }
}

/// Throws std::invalid_argument for what is no study, and for one that is too much to look at.
void judge(const protocol::Recipe& recipe) {
  try {
    const protocol::PointTable table(recipe);
    if (table.size() > Looks::kMostPoints) {
      throw std::invalid_argument(fmt::format(
          "that has {} points; {} are looked at together at most: ask for fewer, or submit it",
          table.size(), Looks::kMostPoints));
    }
    for (std::uint64_t model = 0; model < table.models(); ++model) {
      judge_cost(table.model(model));
    }
  } catch (const solver::InputError& error) {
    throw std::invalid_argument(error.what());
  }
}

}  // namespace

Talk Looks::begin(const HttpQuestion& question) {
  protocol::SubmitRequest asked = study_of_body(question.body);
  judge(asked.recipe());
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

std::variant<HttpAnswer, Talk> Looks::keep(std::uint64_t study, const HttpQuestion& question) {
  const auto body = nlohmann::json::parse(question.body, nullptr, false);
  if (!body.is_object() || !body.contains("name") || !body["name"].is_string()) {
    throw std::invalid_argument("the body must be {\"name\": NAME}");
  }
  const std::string name = body["name"];
  if (std::ranges::find(kept_studies_, study) != kept_studies_.end()) {
    return kept_already(study, name);
  }
  const auto look = looks_.find(study);
  if (look == looks_.end() || look->second.going) {
    return error_answer(kItHasGone, "there is nothing here");
  }
  // Of two names the second would find the study under the first one, and make another.
  if (!look->second.kept_as.empty() && look->second.kept_as != name) {
    return error_answer(kKeptAlready, kept_as(look->second.kept_as));
  }
  look->second.kept_as = name;
  look->second.seen = Clock::now();
  protocol::SubmitRequest kept = look->second.request;
  ClientRequest request;
  request.mutable_change()->set_study(kept.name());
  request.mutable_change()->set_study_id(study);
  request.mutable_change()->set_change(protocol::STUDY_CHANGE_RENAME);
  request.mutable_change()->set_new_name(name);
  kept.set_name(name);
  kept.set_priority(0);
  return Talk{request,
              [this, study, kept](const ClientReply& reply) mutable -> Talk::Next {
                if (reply.has_submit()) {
                  return json_answer({{"id", study}, {"name", kept.name()}});
                }
                is_kept(study);
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
              [this, study](const protocol::ErrorReply& error) -> Talk::Next {
                if (const auto refused = looks_.find(study); refused != looks_.end()) {
                  refused->second.kept_as.clear();  // another name may do
                }
                return failure(error);
              },
              true};
}

void Looks::is_kept(std::uint64_t study) {
  constexpr std::size_t kMostRemembered = 64;
  if (looks_.erase(study) > 0) {
    kept_studies_.push_back(study);
    if (kept_studies_.size() > kMostRemembered) {
      kept_studies_.pop_front();
    }
  }
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
