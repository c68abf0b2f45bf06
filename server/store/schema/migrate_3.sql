-- From schema version 3 to 4: results have the largest reactions; rows have checksums; failed points
-- that are solved again go on counting their attempts.
ALTER TABLE results ADD COLUMN reaction_peaks TEXT;
ALTER TABLE results ADD COLUMN checksum INTEGER;
ALTER TABLE studies ADD COLUMN checksum INTEGER;

-- Failed points that were forgotten to be solved again: runs of neighbours that had failed in one
-- attempt. Where several rows name a point the last one counts.
CREATE TABLE retries (
  study_id    INTEGER NOT NULL REFERENCES studies (study_id),
  first_point INTEGER NOT NULL,
  points      INTEGER NOT NULL,
  attempt     INTEGER NOT NULL,  -- that failed; the next one has a higher number
  retried_at  TEXT NOT NULL
) STRICT;
