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

/// Runs of all sets that are kept: 64 MiB.
constexpr std::size_t kMostKeptRuns = PointSet::kMostRuns;

ClientRequest points_that_meet(const std::string& study, const std::string& condition) {
  ClientRequest request;
  request.mutable_query()->set_in_chunks(true);
  request.mutable_query()->mutable_question()->set_study(study);
  request.mutable_query()->mutable_question()->set_where(condition);
  request.mutable_query()->mutable_question()->add_select("point");
  return request;
}

/// False: they are too many, or come in another order than asked for.
bool take_points(const protocol::QueryReply& chunk, PointSet& points) {
  if (!protocol::is_sound(chunk) || (chunk.chunk_rows() > 0 && chunk.columns_size() != 1)) {
    return false;
  }
  for (protocol::ChunkRows rows(chunk); rows.next();) {
    if (rows.cell(0).kind != protocol::CellKind::kInteger ||
        !points.add(static_cast<std::uint64_t>(rows.cell(0).integer))) {
      return false;
    }
  }
  return true;
}

}  // namespace

/// Points as they come, chunk by chunk.
struct PointFilters::Coming {
  Asked asked;
  std::string study = {};
  std::uint64_t chunks = 0;
  bool is_asked_as_written = false;
  std::shared_ptr<PointSet> points = std::make_shared<PointSet>();
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
      if (Shared known = find(coming->asked)) {
        return picture(std::move(known));
      }
      return points_that_meet(now.name(), coming->asked.condition);
    }
    ++coming->chunks;
    if (!take_points(reply.query(), *coming->points)) {
      return error_answer(kWrong,
                          fmt::format("the points that meet the condition are too many and lie too "
                                      "far apart: {} of them in turns are the most",
                                      PointSet::kMostRuns));
    }
    if (reply.query().ends()) {
      keep(coming->asked, coming->points);
      return picture(coming->points);
    }
    ClientRequest more;
    more.mutable_more_rows()->set_request_id(request);
    more.mutable_more_rows()->set_taken(coming->chunks);
    return more;
  };
  // What is wrong is told of what people wrote, and not of what was added to it.
  const auto failed =
      [coming, condition = std::move(condition)](const protocol::ErrorReply& error) -> Talk::Next {
    if (!error.wrong_request() || coming->study.empty() ||
        std::exchange(coming->is_asked_as_written, true)) {
      return failure(error);
    }
    coming->chunks = 0;  // what came of the first question is no part of this answer
    coming->points = std::make_shared<PointSet>();
    return points_that_meet(coming->study, condition);
  };
  return {status_of_number(study), go_on, too_slow(), failed};
}

PointFilters::Shared PointFilters::find(const Asked& asked) {
  const auto found = std::find_if(kept_.begin(), kept_.end(),
                                  [&](const Kept& kept) { return kept.asked == asked; });
  if (found == kept_.end()) {
    return nullptr;
  }
  kept_.splice(kept_.begin(), kept_, found);
  return kept_.front().points;
}

void PointFilters::keep(const Asked& asked, Shared points) {
  constexpr std::size_t kMostKept = 64;
  std::erase_if(kept_, [&](const Kept& kept) {
    return kept.asked.study == asked.study && kept.asked.condition == asked.condition;
  });
  kept_.push_front({asked, std::move(points)});
  std::size_t runs = 0;
  std::size_t sets = 0;
  std::erase_if(kept_, [&](const Kept& kept) {
    runs += kept.points->runs();
    return runs > kMostKeptRuns || ++sets > kMostKept;
  });
}

}  // namespace oblique::server
