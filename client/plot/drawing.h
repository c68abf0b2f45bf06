#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client/plot/axis_choice.h"
#include "client/plot/data/answer_columns.h"
#include "client/plot/data/study_axes.h"
#include "client/plot/figures/maps.h"
#include "client/plot/figures/quantity.h"
#include "client/plot/plot_request.h"
#include "client/service/result_query.h"
#include "client/service/source.h"

namespace oblique::client::plot {

/// FROM:TO; none for an empty text. Throws solver::InputError for any other text.
std::optional<Range> range_given(const std::string& text);

/// The columns of "X,Y", without spaces around them.
std::vector<std::string> names_in(const std::string& text);

/// Draws one picture from the rows of a source. Each picture is made once.
class Drawing {
 public:
  /// All must outlive it.
  Drawing(Source& source, const StudyShape& shape, const PlotRequest& request, const Tell& tell)
      : source_(source), shape_(shape), request_(request), tell_(tell) {}

  Figure map();
  Figure lines();
  Figure scattered();
  Figure counts();

 private:
  /// The rows of the columns, where the condition holds.
  std::vector<AnswerColumn> ask(const std::vector<std::string>& columns);
  /// Sets apart the cells without a row that have one of a point that --where leaves out.
  void tell_filtered(Cells& cells, const ChosenAxis& x, const ChosenAxis& y);
  std::vector<AnswerColumn> answer_to(const ResultQuery& query, std::size_t columns);
  /// The axis that a flag names, else the first that is neither taken nor held by --at. Throws
  /// solver::InputError with the remedy where there is none.
  ChosenAxis chosen_or(const std::string& flag, const std::string& text,
                       const std::vector<ChosenAxis>& taken, const std::string& remedy) const;
  /// The axis whose values are the lines; none: one line is drawn.
  std::optional<ChosenAxis> lines_by(const ChosenAxis& x) const;
  /// Whether --at gives the axis a value.
  bool is_held(const StudyAxis& axis) const;
  static Quantity quantity(const ChosenAxis& axis, const AnswerColumn& column);
  static bool is_logarithmic_by_study(const ChosenAxis& axis);
  ColourChoice colours() const;
  /// Says which block is drawn, and how much is not.
  void say_block(Figure& figure) const;
  /// Title and subtitle; says what was chosen.
  void entitle(Figure& figure, const std::string& what, std::uint64_t points) const;
  static void refuse_log_of_nothing(const std::string& flag, bool is_asked,
                                    const AnswerColumn& column);

  Source& source_;
  const StudyShape& shape_;
  const PlotRequest& request_;
  const Tell& tell_;
  Condition condition_ = {};
};

}  // namespace oblique::client::plot
