#include "worker/trace_thinning.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "worker/solver/model/trace_columns.h"

namespace oblique::worker {
namespace {

/// Which rows of the fall are kept, so that both ends are and they lie evenly.
std::uint64_t fall_step(std::size_t most_rows) {
  constexpr std::uint64_t kSteps = solver::kFallRows - 1;
  std::uint64_t step = 1;
  while (step < kSteps && (kSteps % step != 0 || kSteps / step + 1 > most_rows)) {
    ++step;
  }
  return step;
}

}  // namespace

void TraceThinning::Stretch::take(const Stretch& next) {
  if (next.largest_normal->fn_N > largest_normal->fn_N) {
    largest_normal = next.largest_normal;
  }
  if (next.smallest_normal->fn_N < smallest_normal->fn_N) {
    smallest_normal = next.smallest_normal;
  }
  if (next.largest_tangential->ft_N > largest_tangential->ft_N) {
    largest_tangential = next.largest_tangential;
  }
}

std::size_t TraceThinning::most_rows() const {
  return std::max(most_bytes_ / row_bytes_, kFewestRows);
}

void TraceThinning::add(const solver::TraceRow& row) {
  const bool falls = row.state == solver::kFalling;
  auto made = std::make_shared<Row>(Row{.number = falls ? rows_of_fall_++ : rows_of_contact_++,
                                        .numbers = {},
                                        .fn_N = row.fn_N,
                                        .ft_N = std::abs(row.ft_N),
                                        .state = solver::code_of_state(row.state)});
  solver::append_numbers(row, made->numbers);
  row_bytes_ = bytes_of(made->numbers.size());
  if (falls) {
    if (made->number % fall_step(most_rows() / 4) == 0) {
      fall_.push_back(std::move(made));
    }
    return;
  }
  const std::size_t most = most_rows() - fall_.size();
  if (last_ && last_->state != made->state && changes_.size() + 2 <= most / 4) {
    changes_.push_back(last_);
    changes_.push_back(made);
  }
  last_ = made;
  const Stretch own{made, made, made, made};
  if (made->number % a_stretch_ == 0) {
    stretches_.push_back(own);
  } else {
    stretches_.back().take(own);
  }
  // A row is at most one more that is kept, so that they need not be counted every time.
  if (++kept_at_most_ <= most) {
    return;
  }
  kept_at_most_ = contact_rows().size();
  while (stretches_.size() > 1 && kept_at_most_ > most - most / 8) {
    halve();
    kept_at_most_ = contact_rows().size();
  }
}

void TraceThinning::halve() {
  a_stretch_ *= 2;
  std::vector<Stretch> halved;
  for (std::size_t i = 0; i < stretches_.size(); ++i) {
    if (i % 2 == 0) {
      halved.push_back(stretches_[i]);
    } else {
      halved.back().take(stretches_[i]);
    }
  }
  stretches_ = std::move(halved);
}

/// Each once, in the order of time.
std::vector<TraceThinning::Shared> TraceThinning::contact_rows() const {
  std::vector<Shared> contact = changes_;
  for (const Stretch& stretch : stretches_) {
    contact.insert(contact.end(), {stretch.first, stretch.largest_normal, stretch.smallest_normal,
                                   stretch.largest_tangential});
  }
  if (last_) {
    contact.push_back(last_);
  }
  const auto is_earlier = [](const Shared& a, const Shared& b) { return a->number < b->number; };
  std::sort(contact.begin(), contact.end(), is_earlier);
  contact.erase(std::unique(contact.begin(), contact.end()), contact.end());
  return contact;
}

std::vector<TraceThinning::Shared> TraceThinning::rows() const {
  std::vector<Shared> all = fall_;
  const std::vector<Shared> contact = contact_rows();
  all.insert(all.end(), contact.begin(), contact.end());
  return all;
}

}  // namespace oblique::worker
