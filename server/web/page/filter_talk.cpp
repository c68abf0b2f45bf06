#include "server/web/page/filter_talk.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/wire/chunk_rows.h"
#include "server/web/answers/point_filter.h"
#include "server/web/answers/study_answers.h"
#include "server/web/http/json_answer.h"

namespace oblique::server {
namespace {

using protocol::ClientReply;
using protocol::ClientRequest;

constexpr unsigned kWrong = 400;
constexpr unsigned kAskAgain = 202;

/// What took longer to find than this is used for as long as it took.
constexpr std::chrono::seconds kLong{2};
constexpr std::chrono::seconds kLongestUse{60};

/// Runs of all sets that are kept: 64 MiB.
constexpr std::size_t kMostKeptRuns = PointSet::kMostRuns;

ClientRequest points_that_meet(const std::string& study, const std::string& condition) {
  ClientRequest request;
  request.mutable_query()->mutable_question()->set_study(study);
  request.mutable_query()->mutable_question()->set_where(condition);
  request.mutable_query()->mutable_question()->add_select("point");
  return request;
}

/// False: they are too many, or come in another order than asked for.
bool take_points(const protocol::QueryReply& chunk, PointSet& points, std::uint64_t& last) {
  if (!protocol::is_sound(chunk) || (chunk.chunk_rows() > 0 && chunk.columns_size() != 1)) {
    return false;
  }
  for (protocol::ChunkRows rows(chunk); rows.next();) {
    if (rows.cell(0).kind != protocol::CellKind::kInteger ||
        !points.add(static_cast<std::uint64_t>(rows.cell(0).integer))) {
      return false;
    }
    last = static_cast<std::uint64_t>(rows.cell(0).integer);
  }
  return true;
}

}  // namespace

/// Points as they come, chunk by chunk.
struct PointFilters::Coming {
  Asked asked;
  Clock::time_point begun = Clock::now();
  Clock::time_point wanted = begun;  ///< by somebody, the last time
  std::string study = {};
  std::uint64_t study_points = 0;
  std::uint64_t last_point = 0;
  std::uint64_t chunks = 0;
  bool is_asked_as_written = false;
  std::shared_ptr<PointSet> points = std::make_shared<PointSet>();

  /// Points come in their order, so that the last one tells how far it is.
  HttpAnswer so_far() const {
    const auto share = study_points == 0
                           ? 0.0
                           : static_cast<double>(last_point) / static_cast<double>(study_points);
    return json_answer({{"state", "the condition is asked of all points: ask again"},
                        {"share", std::min(share, 1.0)}},
                       kAskAgain);
  }
};

FilteredPicture PointFilters::begin(std::uint64_t study, const HttpQuestion& question,
                                    bool is_slice) {
  auto asked = std::make_shared<FilterQuestion>();
  return {filter_job(study, question.fields, is_slice, asked),
          [this, study, asked, is_slice, fields = question.fields, number = question.number] {
            return talk(study, asked->condition, asked->narrowed, number,
                        [study, is_slice, fields](Shared points) {
                          return is_slice ? slice_job(study, fields, std::move(points))
                                          : bins_job(study, fields, std::move(points));
                        });
          }};
}

Talk PointFilters::talk(std::uint64_t study, std::string condition, std::string narrowed,
                        std::uint64_t request, std::function<AnswerPool::Job(Shared)> picture) {
  auto coming = std::make_shared<Coming>();
  coming->asked = {study, std::move(narrowed)};
  const auto go_on = [this, coming, request, picture](const ClientReply& reply) -> Talk::Next {
    if (reply.has_status()) {
      if (reply.status().studies_size() != 1) {
        return no_such_study();
      }
      const protocol::StudyStatus& now = reply.status().studies(0);
      coming->study = now.name();
      coming->asked.solved = now.solved();
      coming->asked.failed = now.failed();
      coming->study_points = now.points();
      if (Shared known = find(coming->asked)) {
        return picture(std::move(known));
      }
      if (auto fault = fault_of(coming->asked)) {
        return *std::move(fault);
      }
      if (const auto other = under_way(coming->asked)) {
        other->wanted = Clock::now();
        return other->so_far();
      }
      comings_.push_back(coming);
      return points_that_meet(now.name(), coming->asked.condition);
    }
    ++coming->chunks;
    if (!take_points(reply.query(), *coming->points, coming->last_point)) {
      return error_answer(kWrong,
                          fmt::format("the points that meet the condition are too many and lie too "
                                      "far apart: {} of them in turns are the most",
                                      PointSet::kMostRuns));
    }
    if (reply.query().ends()) {
      keep(*coming);
      return picture(coming->points);
    }
    ClientRequest more;
    more.mutable_more_rows()->set_request_id(request);
    more.mutable_more_rows()->set_taken(coming->chunks);
    return more;
  };
  // What is wrong is told of what people wrote, and not of what was added to it.
  const auto failed = [this, coming, condition = std::move(condition)](
                          const protocol::ErrorReply& error) -> Talk::Next {
    if (!error.wrong_request() || coming->study.empty() ||
        std::exchange(coming->is_asked_as_written, true)) {
      const auto now = Clock::now();
      if (now - coming->begun > kLong) {  // who was told to ask again hears it
        faults_.push_back({coming->asked, failure(error), now + kWaitedFor});
      }
      return failure(error);
    }
    coming->chunks = 0;  // what came of the first question is no part of this answer
    coming->points = std::make_shared<PointSet>();
    return points_that_meet(coming->study, condition);
  };
  Talk::Background background{[coming] { return coming->so_far(); },
                              [coming] { return Clock::now() - coming->wanted > kWaitedFor; }};
  return {status_of_number(study), go_on, too_slow(), failed, false, std::move(background)};
}

std::optional<HttpAnswer> PointFilters::fault_of(const Asked& asked) {
  std::erase_if(faults_, [now = Clock::now()](const Fault& fault) { return fault.until < now; });
  const auto found = std::find_if(faults_.begin(), faults_.end(), [&](const Fault& fault) {
    return fault.asked.study == asked.study && fault.asked.condition == asked.condition;
  });
  return found == faults_.end() ? std::nullopt : std::optional(found->answer);
}

/// The same condition that is asked already.
std::shared_ptr<PointFilters::Coming> PointFilters::under_way(const Asked& asked) {
  std::erase_if(comings_, [](const std::weak_ptr<Coming>& each) { return each.expired(); });
  for (const std::weak_ptr<Coming>& each : comings_) {
    const auto coming = each.lock();
    if (coming && coming->asked.study == asked.study &&
        coming->asked.condition == asked.condition) {
      return coming;
    }
  }
  return nullptr;
}

PointFilters::Shared PointFilters::find(const Asked& asked) {
  const auto found =
      std::find_if(kept_.begin(), kept_.end(), [&, now = Clock::now()](const Kept& kept) {
        return kept.asked == asked || (now < kept.until && kept.asked.study == asked.study &&
                                       kept.asked.condition == asked.condition);
      });
  if (found == kept_.end()) {
    return nullptr;
  }
  kept_.splice(kept_.begin(), kept_, found);
  return kept_.front().points;
}

void PointFilters::keep(const Coming& coming) {
  constexpr std::size_t kMostKept = 64;
  const Asked& asked = coming.asked;
  const auto now = Clock::now();
  const auto took = std::min<Clock::duration>(now - coming.begun, kLongestUse);
  std::erase_if(kept_, [&](const Kept& kept) {
    return kept.asked.study == asked.study && kept.asked.condition == asked.condition;
  });
  kept_.push_front({asked, coming.points, took > kLong ? now + took : now});
  std::size_t runs = 0;
  std::size_t sets = 0;
  std::erase_if(kept_, [&](const Kept& kept) {
    runs += kept.points->runs();
    return runs > kMostKeptRuns || ++sets > kMostKept;
  });
}

}  // namespace oblique::server
