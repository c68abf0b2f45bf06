-- From schema version 7 to 8: results are packed (results.sql), which the program does row by row; `results`
-- becomes a view. The views name the table, and must not be looked at meanwhile.
DROP VIEW IF EXISTS runs;
DROP VIEW IF EXISTS reaction_peaks;
DROP VIEW IF EXISTS stick_intervals;
DROP VIEW IF EXISTS phases;
DROP VIEW IF EXISTS peaks;
DROP INDEX IF EXISTS failed_points;
PRAGMA legacy_alter_table = ON;
ALTER TABLE results RENAME TO results_7;
PRAGMA legacy_alter_table = OFF;
ALTER TABLE studies ADD COLUMN counted INTEGER NOT NULL DEFAULT 0;
ALTER TABLE about ADD COLUMN last_study_id INTEGER NOT NULL DEFAULT 0;
CREATE TABLE deletions (study_id INTEGER PRIMARY KEY) STRICT;
ALTER TABLE studies ADD COLUMN takes_over INTEGER NOT NULL DEFAULT 0;
ALTER TABLE workers ADD COLUMN checksum INTEGER;
UPDATE workers SET checksum =
  row_checksum(worker_id, name, threads, solver_version, instruction_set, joined_at);
