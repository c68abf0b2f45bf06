# The largest normal force by drop and coefficient of friction, at the largest restitution.
library(DBI)

database <- dbConnect(RSQLite::SQLite(), commandArgs(trailingOnly = TRUE)[1], flags = RSQLite::SQLITE_RO)
runs <- dbGetQuery(database, "
  SELECT H, mu, fn_peak_N, max(e) AS e FROM runs
  WHERE study_id = (SELECT min(study_id) FROM studies) AND status = 'solved'
  GROUP BY H, mu ORDER BY H, mu")
dbDisconnect(database)
cat("H,mu,fn_peak_N\n")
cat(sprintf("%.17g,%.17g,%.17g\n", runs$H, runs$mu, runs$fn_peak_N), sep = "")
