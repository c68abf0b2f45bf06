#pragma once

#include <string>
#include <vector>

#include "client/formats/npz_printer.h"
#include "client/formats/sink.h"
#include "worker/solver/model/trace_columns.h"

namespace oblique::client {

/// A trace on its way into NumPy's archive: an array a column of the CSV under the same name, all
/// as long as there are instants, and the positions of nodes as one array `nodes_m` with the
/// indices instant, node, and x or y. Rows are kept in files without a name.
class TraceArchive {
 public:
  /// Those files are made in `folder`; empty: in that for temporary files.
  TraceArchive(const solver::TraceShape& shape, const std::string& folder);

  void add(const solver::TraceRow& row);
  void write(Sink& sink) const { write_npz(columns_, sink); }

 private:
  std::vector<NamedColumn> columns_;
};

}  // namespace oblique::client
