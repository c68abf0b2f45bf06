-- From schema version 1 to 2: studies can be paused, and have a priority and a weight. A table's checks
-- cannot be altered, so it is made anew. The views name it, and must not be looked at meanwhile.
PRAGMA legacy_alter_table = ON;

CREATE TABLE studies_2 (
  study_id    INTEGER PRIMARY KEY,
  name        TEXT NOT NULL UNIQUE,
  recipe      BLOB NOT NULL,
  points      INTEGER NOT NULL,
  state       TEXT NOT NULL CHECK (state IN ('running', 'paused', 'cancelled', 'done')),
  created_at  TEXT NOT NULL,
  changed_at  TEXT NOT NULL,
  priority    INTEGER NOT NULL,
  weight      REAL NOT NULL
) STRICT;
INSERT INTO studies_2
SELECT study_id, name, recipe, points, state, created_at, changed_at, 0, 1.0 FROM studies;
DROP TABLE studies;
ALTER TABLE studies_2 RENAME TO studies;

PRAGMA legacy_alter_table = OFF;
