#include "server/service/outbox/request_reader.h"

#include <algorithm>
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

/// Whoever asks for more should make several studies. Of all recipes of a client that wait.
constexpr std::chrono::minutes kLongestSurvey{10};
/// While others wait.
constexpr std::chrono::milliseconds kSurveyTurn{50};

/// Looks at points until all are seen, and makes it the table; false: it was ended before.
bool survey_of(ReadRequest& read, const std::function<bool()>& goes_on) {
  try {
    if (!read.unsurveyed->survey(goes_on)) {
      return false;
    }
    read.table = std::make_shared<const protocol::PointTable>(std::move(*read.unsurveyed));
  } catch (const solver::InputError& error) {
    read.objection = error.what();
  }
  read.needs_survey = false;
  read.unsurveyed.reset();
  return true;
}

void end_survey(ReadRequest& read) {
  read.needs_survey = false;
  read.unsurveyed.reset();
  read.objection =
      "the points of the study are looked at one by one, for its filters and expressions, and "
      "that was ended because it took too long: make several studies, or a simpler expression";
}

/// The table of a recipe. What a client says of counts does not count.
void judge(protocol::Recipe recipe, const std::function<bool()>& goes_on, ReadRequest& read) {
  for (protocol::Block& block : *recipe.mutable_blocks()) {
    block.clear_points_left_in();
  }
  auto table = std::make_shared<protocol::PointTable>(std::move(recipe));
  read.needs_survey = table->needs_survey();
  if (!read.needs_survey) {
    read.table = std::make_shared<const protocol::PointTable>(std::move(*table));
    return;
  }
  read.unsurveyed = std::move(table);
  if (goes_on && !survey_of(read, goes_on)) {
    end_survey(read);
  }
}

}  // namespace

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
  const std::uint64_t bytes = job.of_study ? job.of_study->recipe_bytes().size() : job.frame.size();
  reading_.waiting.push_back({std::move(job), bytes});
  wake_.notify_all();
}

void RequestReader::cancel(std::uint64_t ticket) {
  const std::lock_guard lock(mutex_);
  for (Line* line : {&reading_, &surveying_}) {
    std::erase_if(line->waiting,
                  [&](const Waiting& waiting) { return waiting.job.ticket == ticket; });
    line->is_wanted = line->is_wanted && line->ticket != ticket;
  }
}

/// The one whose turn it is.
RequestReader::Waiting RequestReader::next(Line& line) {
  std::erase_if(line.spent, [&](const auto& entry) {
    return std::none_of(line.waiting.begin(), line.waiting.end(),
                        [&](const Waiting& waiting) { return waiting.job.client == entry.first; });
  });
  auto first = line.waiting.begin();
  if (++line.turns % 2 == 1) {
    const auto rank = [&](const Waiting& waiting) {
      return std::pair(line.spent[waiting.job.client], waiting.size);
    };
    first = std::min_element(line.waiting.begin(), line.waiting.end(),
                             [&](const Waiting& a, const Waiting& b) { return rank(a) < rank(b); });
  }
  Waiting waiting = std::move(*first);
  line.waiting.erase(first);
  return waiting;
}

ReadReport RequestReader::read(const ReadJob& job) {
  ReadReport report{job.ticket, {}};
  try {
    if (job.of_study) {
      report.point = read_point(job.of_study->recipe_bytes(), job.point);
    } else {
      report.read = read_request(job.frame, {});
    }
  } catch (const std::exception&) {  // there is no memory for it
    if (job.of_study) {
      report.point.emplace().objection = "there is no memory to read its study";
    }
    report.read.request_id = protocol::request_id_of(job.frame);
  }
  return report;
}

/// One turn; true when it came to an end. `spent` on its client before.
bool RequestReader::survey(Waiting& waiting, Clock::duration spent) {
  std::optional<Clock::time_point> began;  // asking, so that each turn sees points
  bool is_too_long = false;
  const auto goes_on = [&] {
    const auto now = Clock::now();
    const auto past = now - began.value_or(now);
    began = now - past;
    is_too_long = spent + past >= kLongestSurvey;
    const std::lock_guard lock(mutex_);
    return !is_too_long && !stopping_ && surveying_.is_wanted &&
           (past < kSurveyTurn || surveying_.waiting.empty());
  };
  try {
    if (survey_of(waiting.read, goes_on)) {
      return true;
    }
    if (is_too_long) {
      end_survey(waiting.read);
    }
    return is_too_long;
  } catch (const std::exception&) {  // there is no memory for it
    const std::uint64_t request_id = waiting.read.request_id;
    waiting.read = {};
    waiting.read.request_id = request_id;
    return true;
  }
}

void RequestReader::run(Line& line, bool surveys) {
  std::unique_lock lock(mutex_);
  while (true) {
    wake_.wait(lock, [&] { return stopping_ || !line.waiting.empty(); });
    if (stopping_) {
      return;
    }
    Waiting waiting = next(line);
    const Clock::duration spent = line.spent[waiting.job.client];
    line.ticket = waiting.job.ticket;
    line.is_wanted = true;
    lock.unlock();
    const auto began = Clock::now();
    ReadReport report{waiting.job.ticket, {}};
    bool is_done = true;
    if (surveys) {
      is_done = survey(waiting, spent);
      report.read = std::move(waiting.read);
    } else {
      report = read(waiting.job);
      is_done = !report.read.needs_survey;
    }
    if (is_done) {
      report_(std::move(report));
    } else {
      waiting.job.frame.clear();
      waiting.read = std::move(report.read);
    }
    lock.lock();
    line.spent[waiting.job.client] += Clock::now() - began;
    if (!is_done && line.is_wanted) {
      waiting.size = waiting.read.unsurveyed->size();
      surveying_.waiting.push_back(std::move(waiting));
      wake_.notify_all();
    }
  }
}

}  // namespace oblique::server
