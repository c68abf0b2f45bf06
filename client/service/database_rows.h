#pragma once

#include "client/service/source.h"
#include "server/query/reader.h"

namespace oblique::client {

/// An answer from a database file. A chunk that takes longer than the time limit is an error; one
/// that cannot be stopped then ends the program soon after. Until it ends or is destroyed, a server
/// cannot truncate the write-ahead log of the database.
class DatabaseRows : public RowStream {
 public:
  DatabaseRows(server::Reader& reader, const protocol::QueryRequest& request,
               const server::QueryLimits& limits);

  protocol::QueryReply next() override;

 private:
  const server::QueryLimits limits_;
  server::Answer answer_;
};

}  // namespace oblique::client
