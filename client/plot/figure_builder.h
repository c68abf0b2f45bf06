#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "client/plot/axis_choice.h"
#include "client/plot/figure.h"
#include "client/plot/gathered.h"
#include "client/plot/plot_request.h"
#include "client/plot/study_shape.h"
#include "client/service/source.h"

namespace oblique::client::plot {

/// FROM:TO; none for an empty text. Throws solver::InputError for any other text.
std::optional<Range> range_given(const std::string& text);

/// The columns of "X,Y", without spaces around them.
std::vector<std::string> names_in(const std::string& text);

/// Makes one figure from the rows of a source.
class FigureBuilder {
 public:
  /// All must outlive it.
  FigureBuilder(Source& source, const StudyShape& shape, const PlotRequest& request,
                const Tell& tell)
      : source_(source), shape_(shape), request_(request), tell_(tell) {}

  Figure map();
  Figure lines();
  Figure scatter();
  Figure histogram();

 private:
  /// The rows of the columns, where the condition holds.
  std::vector<AnswerColumn> query(const std::vector<std::string>& columns);
  std::vector<AnswerColumn> answer_to(const ResultQuery& query, std::size_t columns);
  /// Sets apart the cells without a row that have one of a point that --where leaves out.
  void find_filtered(Cells& cells, const ChosenAxis& x, const ChosenAxis& y);
  Gathered gather_map(const MapRows& rows, const ChosenAxis& x, const ChosenAxis& y,
                      const Panel& panel);
  /// The axis that a flag names, else the first that is neither taken nor held by --at. Throws
  /// solver::InputError with the remedy where there is none.
  ChosenAxis chosen_or(const std::string& flag, const std::string& text,
                       const std::vector<ChosenAxis>& taken, const std::string& remedy) const;
  /// The axis whose values are the lines; none: one line is drawn.
  std::optional<ChosenAxis> lines_by(const ChosenAxis& x) const;
  /// Whether --at gives the axis a value.
  bool is_held(const StudyAxis& axis) const;
  /// Throws solver::InputError, naming the flag, for a logarithmic axis without a positive value.
  FigureAxis axis_for(const std::string& flag, const ChosenAxis& axis, const AnswerColumn& column,
                      bool is_logarithmic) const;
  /// The scale of colours for values, from --range or theirs; says what lies outside.
  FigureAxis colours_for(Figure& figure, FigureAxis axis, const std::vector<double>& values) const;
  /// Title and subtitle; tells what was chosen.
  void add_titles(Figure& figure, const std::string& what, std::uint64_t points) const;

  Source& source_;
  const StudyShape& shape_;
  const PlotRequest& request_;
  const Tell& tell_;
  Condition condition_ = {};
};

/// Turns cells with texts into cells with categories: those with most points, largest first, with
/// the rest as one "other". Notes what is left out.
void add_categories(Figure& figure, Cells& cells,
                    const std::map<std::string, std::uint64_t>& points, const std::string& plural);

/// Cells whose values have no place on the scale become cells without a value. Notes what is blank.
void blank_undrawable(Figure& figure, Cells& cells, bool is_logarithmic);

/// Most categories with an entry of their own.
inline constexpr std::size_t kMostCategories = 12;

/// Counts values in bins of one round width, as many as Freedman and Diaconis advise and at most
/// about 100; of a logarithmic axis in equal ratios.
Bars binned(const std::vector<double>& values, const Range& range, bool is_logarithmic);

/// The most frequent names, largest first, and the others together.
Bars counted(const AnswerColumn& column);

}  // namespace oblique::client::plot
