#include "client/service/watching.h"

#include <spdlog/fmt/fmt.h>
#include <algorithm>
#include <chrono>
#include <iostream>
#include <stdexcept>
#include <variant>
#include "client/io/console.h"
#include "client/io/progress.h"
#include "client/io/row_output.h"
#include "proto/program/usage.h"
#include "proto/result_message.h"
#include "proto/text.h"
#include "server/query/sql_text.h"

namespace oblique::client {
namespace {

using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

// Pause between status requests. It begins short, to notice the end of a short study, and grows, so
// that there are few requests.
Seconds pause_after(Seconds elapsed) {
  constexpr Seconds kShortest{0.004};
  constexpr Seconds kLongest{0.5};
  return std::clamp(elapsed / 40, kShortest, kLongest);
}

void print_failures(Console& console, const protocol::StudyStatus& status,
                    const std::function<protocol::Table(const std::string&)>& query) {
  console.errors() << fmt::format("{} of {} points failed:\n", format_count(status.failed()),
                                  format_count(status.points()));
  const auto reasons = query(fmt::format(
      "SELECT error, count(*), min(point) FROM runs WHERE study = {} AND status = 'failed' "
      "GROUP BY error ORDER BY count(*) DESC LIMIT 10",
      server::sql_text(status.name())));
  for (const auto& row : reasons.rows) {
    console.errors() << fmt::format(
        "  {} x {} (first at point {})\n",
        format_count(static_cast<std::uint64_t>(std::get<std::int64_t>(row[1]))),
        protocol::visible(std::get<std::string>(row[0])), std::get<std::int64_t>(row[2]));
  }
}

}  // namespace

std::string WaitMessages::update(const protocol::StudyStatus& status, Seconds elapsed) {
  if (status.waits_for() != reason_) {
    reason_ = status.waits_for();
    since_ = elapsed;
  }
  if (reason_ == said_ || (!reason_.empty() && elapsed - since_ < kShortestWait)) {
    return {};
  }
  said_ = reason_;
  return reason_.empty() ? "The study continues." : fmt::format("The study waits for {}.", reason_);
}

protocol::StudyStatus watch_study(Console& console, const AskStatus& ask,
                                  protocol::StopSignals& stop) {
  Progress progress(console);
  const Tell tell = [&progress, tell = tell_errors(console)](const std::string& sentence) {
    progress.finish();
    tell(sentence);
  };
  const auto start = Clock::now();
  WaitMessages messages;
  for (;;) {
    auto status = ask(tell);
    const Seconds elapsed = Clock::now() - start;
    const std::uint64_t completed = protocol::completed_points(status);
    progress.update({.study = status.name(),
                     .points = status.points(),
                     .completed = completed,
                     .failed = status.failed(),
                     .left_out = status.left_out(),
                     .elapsed_s = elapsed.count()});
    if (const auto sentence = messages.update(status, elapsed); !sentence.empty()) {
      progress.finish();
      console.note(sentence);
    }
    const bool over =
        (status.state() != "running" && status.state() != "paused") || completed == status.points();
    if (over ||
        stop.wait(std::chrono::duration_cast<std::chrono::nanoseconds>(pause_after(elapsed)))) {
      progress.finish();
      return status;
    }
  }
}

Tell tell_errors(Console& console) {
  return [&console](const std::string& sentence) {
    console.errors() << protocol::visible(sentence) << '\n';
  };
}

protocol::StudyStatus study_named(Source& source, const std::string& name, const Tell& tell) {
  const auto found = source.status(name, tell);
  if (found.size() != 1) {
    throw std::runtime_error(
        fmt::format("there is no study called \"{}\" in {}", name, source.place()));
  }
  return found.front();
}

protocol::StudyStatus FollowedStudy::status(const Tell& tell) {
  auto status = study_id_ == 0 ? study_named(source_, name_, tell)
                               : source_.status_of(study_id_, name_, tell);
  study_id_ = status.study_id();
  if (status.name() != name_) {
    if (tell) {
      tell(fmt::format("{} is now called {}.", name_, status.name()));
    }
    name_ = status.name();
  }
  return status;
}

int print_end(Console& console, const protocol::StudyStatus& status,
              const std::function<protocol::Table(const std::string&)>& query) {
  if (status.failed() > 0) {
    print_failures(console, status, query);
  }
  if (status.state() == "cancelled") {
    console.errors() << "The study is cancelled; `oblique resume` continues it.\n";
  }
  return status.solved() + status.left_out() == status.points() ? protocol::kDone
                                                                : protocol::kFailed;
}

void warn_if_insecure(Console& console, const std::string& access, const std::string& place) {
  if (access == "insecure") {
    console.note(
        fmt::format("INSECURE: {} runs with --insecure: anyone who can reach it can use it, and "
                    "nothing is encrypted.",
                    place));
  }
}

std::string reused_points_note(const protocol::ReusedPoints& taken) {
  if (taken.points() == 0 && !taken.cut_short()) {
    return {};
  }
  std::string text =
      counted(taken.points(), "point", "points") + " reused" + (taken.under_way() ? " so far" : "");
  std::uint64_t named = 0;
  for (int i = 0; i < taken.from_size(); ++i) {
    named += taken.from(i).points();
    text += fmt::format("{} {} from {}", i == 0 ? ":" : ",", format_count(taken.from(i).points()),
                        protocol::visible(taken.from(i).study()));
  }
  if (named < taken.points()) {
    text += fmt::format(", {} from others", format_count(taken.points() - named));
  }
  if (taken.cut_short()) {
    text += "; the search for more was cut short";
  }
  return text;
}

protocol::Table table_of(const std::vector<protocol::StudyStatus>& studies) {
  protocol::Table table{.columns = {"study", "state", "points", "solved", "failed", "leased",
                                    "points_per_s", "created_at", "priority", "waits_for",
                                    "left_out"}};
  const bool any_taken = std::any_of(studies.begin(), studies.end(),
                                     [](const auto& study) { return study.reused().points() > 0; });
  if (any_taken) {
    table.columns.emplace_back("taken_over");
  }
  for (const auto& study : studies) {
    auto& row = table.rows.emplace_back();
    row.emplace_back(study.name());
    row.emplace_back(study.state());
    for (const auto count : {study.points(), study.solved(), study.failed(), study.leased()}) {
      row.emplace_back(static_cast<std::int64_t>(count));
    }
    row.emplace_back(study.points_per_s());
    row.emplace_back(study.created_at());
    row.emplace_back(static_cast<std::int64_t>(study.priority()));
    row.emplace_back(study.waits_for());
    row.emplace_back(static_cast<std::int64_t>(study.left_out()));
    if (any_taken) {
      row.emplace_back(static_cast<std::int64_t>(study.reused().points()));
    }
  }
  return table;
}

}  // namespace oblique::client
