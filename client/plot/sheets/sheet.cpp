#include "client/plot/sheets/sheet.h"

#include <algorithm>

namespace oblique::client::plot {

Size usual_size(const Sheet& sheet) {
  const std::size_t parts = std::max<std::size_t>(1, sheet.parts.size());
  const std::size_t columns = std::clamp<std::size_t>(sheet.columns, 1, parts);
  const std::size_t rows = (parts + columns - 1) / columns;
  constexpr double kTexts = 60.0;
  return {static_cast<double>(columns) * sheet.part.width,
          static_cast<double>(rows) * sheet.part.height + kTexts};
}

Figure flattened(const Sheet& sheet) {
  Figure figure{.title = sheet.title, .subtitle = sheet.subtitle, .notes = sheet.notes};
  for (const Figure& part : sheet.parts) {
    figure.panels.insert(figure.panels.end(), part.panels.begin(), part.panels.end());
    figure.notes.insert(figure.notes.end(), part.notes.begin(), part.notes.end());
  }
  return figure;
}

}  // namespace oblique::client::plot
