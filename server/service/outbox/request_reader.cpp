#include "server/service/outbox/request_reader.h"

#include <chrono>
#include <exception>
#include <memory>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/frames.h"
#include "proto/recipe/checks.h"
#include "proto/recipe/model_message.h"
#include "proto/wire/frame_scan.h"

namespace oblique::server {
namespace {

TracedPoint read_point(const std::string& recipe_bytes, std::uint64_t point) {
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

/// Whoever asks for more should make several studies.
constexpr std::chrono::minutes kLongestSurvey{10};

/// The table of a recipe. What a client says of counts does not count.
void judge(protocol::Recipe recipe, const std::function<bool()>& goes_on, ReadRequest& read) {
  for (protocol::Block& block : *recipe.mutable_blocks()) {
    block.clear_points_left_in();
  }
  protocol::PointTable table(std::move(recipe));
  if (table.needs_survey()) {
    if (!goes_on) {
      read.needs_survey = true;
      return;
    }
    if (!table.survey(goes_on)) {
      read.objection =
          "the points of the study are looked at one by one, for its filters and expressions, and "
          "that was ended because it took too long: make several studies, or a simpler expression";
      return;
    }
  }
  read.table = std::make_shared<const protocol::PointTable>(std::move(table));
}

}  // namespace

TracedPoint traced_point(const protocol::PointTable& table, std::uint64_t point) {
  TracedPoint objected;
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

ReadRequest read_request(std::string_view frame, const std::function<bool()>& goes_on) {
  // Padding cannot make much of a shorter frame.
  constexpr std::size_t kLookedAtAbove = std::size_t{64} * 1024;
  ReadRequest read;
  read.is_readable = (frame.size() <= kLookedAtAbove || protocol::is_of_a_requests_shape(frame)) &&
                     protocol::decode(frame, read.request);
  read.request_id = read.is_readable ? read.request.request_id() : protocol::request_id_of(frame);
  if (!read.is_readable || !read.request.has_submit()) {
    return read;
  }
  try {
    protocol::check_size(read.request.submit().recipe());
    judge(std::move(*read.request.mutable_submit()->mutable_recipe()), goes_on, read);
  } catch (const solver::InputError& error) {
    read.objection = error.what();
  }
  read.request.mutable_submit()->clear_recipe();
  return read;
}

RequestReader::RequestReader(Report report)
    : report_(std::move(report)),
      threads_{std::thread([this] { run(reading_, false); }),
               std::thread([this] { run(surveying_, true); })} {}

RequestReader::~RequestReader() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
    wake_.notify_all();
  }
  for (std::thread& thread : threads_) {
    thread.join();
  }
}

void RequestReader::submit(ReadJob job) {
  const std::lock_guard lock(mutex_);
  reading_.waiting.push_back(std::move(job));
  wake_.notify_all();
}

void RequestReader::cancel(std::uint64_t ticket) {
  const std::lock_guard lock(mutex_);
  for (Line* line : {&reading_, &surveying_}) {
    std::erase_if(line->waiting, [&](const ReadJob& job) { return job.ticket == ticket; });
    line->is_wanted = line->is_wanted && line->ticket != ticket;
  }
}

ReadReport RequestReader::read(const ReadJob& job, bool surveys) {
  ReadReport report{job.ticket, {}};
  const auto until = std::chrono::steady_clock::now() + kLongestSurvey;
  const std::function<bool()> goes_on = [&] {
    const std::lock_guard lock(mutex_);
    return !stopping_ && surveying_.is_wanted && std::chrono::steady_clock::now() < until;
  };
  try {
    if (job.of_study) {
      report.point = read_point(job.of_study->recipe_bytes(), job.point);
    } else {
      report.read = read_request(job.frame, surveys ? goes_on : std::function<bool()>());
    }
  } catch (const std::exception&) {  // there is no memory for it
    if (job.of_study) {
      report.point.emplace().objection = "there is no memory to read its study";
    }
    report.read.request_id = protocol::request_id_of(job.frame);
  }
  return report;
}

void RequestReader::run(Line& line, bool surveys) {
  std::unique_lock lock(mutex_);
  while (true) {
    wake_.wait(lock, [&] { return stopping_ || !line.waiting.empty(); });
    if (stopping_) {
      return;
    }
    ReadJob job = std::move(line.waiting.front());
    line.waiting.pop_front();
    line.ticket = job.ticket;
    line.is_wanted = true;
    lock.unlock();
    ReadReport report = read(job, surveys);
    const bool needs_survey = report.read.needs_survey;
    if (!needs_survey) {
      report_(std::move(report));
    }
    lock.lock();
    if (needs_survey && line.is_wanted) {
      surveying_.waiting.push_back(std::move(job));
      wake_.notify_all();
    }
  }
}

}  // namespace oblique::server
