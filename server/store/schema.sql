-- The database is a public interface: any SQLite tool can read it while a study runs. SI units, named in
-- the columns; times count from touch unless a name says otherwise. PRAGMA application_id identifies the
-- program, PRAGMA user_version is the number of this schema. A file whose stored text differs from this one is
-- refused, so any change inside a statement, of a comment too, raises that number.

-- One row. Workers compare database_id with that of the database that their results are for.
CREATE TABLE about (
  database_id TEXT NOT NULL DEFAULT (lower(hex(randomblob(16)))), -- random; `oblique backup` gives a copy a new one
  starts      INTEGER NOT NULL DEFAULT 0, -- number of times that a server has opened the file
  has_orphans INTEGER NOT NULL DEFAULT 0  -- 1: deleted studies may have left models and workers without rows
) STRICT;

CREATE TABLE studies (
  study_id     INTEGER PRIMARY KEY AUTOINCREMENT CHECK (study_id BETWEEN 1 AND 1000000000000), -- number of the study; never reused
  name         TEXT NOT NULL UNIQUE, -- name of the study
  recipe       BLOB NOT NULL,        -- oblique.protocol.Recipe, serialised: point i is a function of it
  points       INTEGER NOT NULL CHECK (points > 0), -- number of points, including those that `where` leaves out
  errors       INTEGER NOT NULL,     -- 1: the recipe requests estimated errors
  state        TEXT NOT NULL CHECK (state IN ('running', 'paused', 'cancelled', 'done')), -- running, paused, cancelled or done
  created_at   TEXT NOT NULL,        -- UTC, ISO 8601
  changed_at   TEXT NOT NULL,        -- when `state` was last set
  priority     INTEGER NOT NULL DEFAULT 0, -- studies of a higher priority come first
  submitted_by TEXT,                 -- name of the key that first submitted it; NULL: without keys
  counted      INTEGER NOT NULL DEFAULT 1, -- 0: rows were deleted, so `completed_ranges` must be computed again
  left_out     INTEGER NOT NULL DEFAULT 0, -- number of completed points that `where` leaves out
  reuses       INTEGER NOT NULL DEFAULT 0, -- 1: the lookup of results of other studies has not ended
  uid          TEXT NOT NULL DEFAULT (lower(hex(randomblob(16)))), -- random; a study of the same number in another copy of the file has another
  checksum     INTEGER               -- CRC-32 of study_id, recipe, points, errors and created_at; NULL after a change by hand
) STRICT;

-- Every parameter except H, mu and e; one row for each distinct model that has results. The columns are the
-- model keys of study files.
CREATE TABLE models (
  model_id    INTEGER PRIMARY KEY, -- number of the model
  links       INTEGER NOT NULL,    -- number of links
  length      REAL,                -- of every link, m; NULL where they differ
  lengths_m   TEXT NOT NULL,       -- lengths of the links in m as a JSON array, from the pin outwards
  E           REAL NOT NULL,       -- Young's modulus, Pa
  A           REAL NOT NULL,       -- cross-section area, m^2
  I           REAL NOT NULL,       -- second moment of area, m^4
  rho         REAL NOT NULL,       -- density, kg/m^3
  g           REAL NOT NULL,       -- gravity, downwards, m/s^2
  elements_per_link INTEGER NOT NULL, -- elements per link
  k           REAL NOT NULL,       -- normal contact stiffness in compression, N/m
  eta2        REAL NOT NULL,       -- ratio of normal to tangential contact stiffness
  tip_mass    REAL NOT NULL,       -- point mass at the tip, kg
  integrator  TEXT NOT NULL,       -- explicit or generalized-alpha
  spectral_radius REAL NOT NULL,   -- spectral radius of generalized-alpha
  dt          REAL NOT NULL,       -- step in contact, s; 0: chosen by the integrator
  dt_fall     REAL NOT NULL,       -- step in the fall, s; 0: chosen by the integrator
  -- Canonical text of all parameters; proto/recipe/README.md defines it byte by byte.
  definition  TEXT NOT NULL UNIQUE,
  tolerance   REAL NOT NULL,       -- relative error allowed by automatic steps
  checksum    INTEGER              -- CRC-32 of the other columns, model_id excepted; NULL after a change by hand
) STRICT;

-- One row for each session in which a worker delivered a result.
CREATE TABLE workers (
  worker_id       INTEGER PRIMARY KEY, -- number of the worker
  name            TEXT NOT NULL,       -- host and process, for people
  threads         INTEGER NOT NULL,    -- number of solver threads
  solver_version  TEXT NOT NULL,       -- of all its results
  instruction_set TEXT NOT NULL,       -- vector instructions used
  joined_at       TEXT NOT NULL,       -- UTC, ISO 8601
  checksum        INTEGER              -- CRC-32 of the other columns, worker_id excepted; NULL after a change by hand
) STRICT;

-- One row for each solved or failed point. Outputs of a failed point are NULL and `error` says why. Lists are
-- JSON arrays with 8 significant digits.
CREATE TABLE results (
  study_id         INTEGER NOT NULL REFERENCES studies (study_id), -- number of the study
  point            INTEGER NOT NULL, -- number of the point in its study, from 0
  model_id         INTEGER NOT NULL REFERENCES models (model_id),  -- every parameter except H, mu and e
  H                REAL NOT NULL, -- drop of the tip at touch, m
  mu               REAL NOT NULL, -- coefficient of friction
  e                REAL NOT NULL, -- coefficient of restitution
  status           TEXT GENERATED ALWAYS AS (CASE WHEN error IS NULL THEN 'solved' ELSE 'failed' END) VIRTUAL, -- solved or failed
  error            TEXT,          -- why it failed; NULL: solved
  fall_time_s REAL, impact_x_m REAL, vt_in_m_s REAL, vn_in_m_s REAL, duration_s REAL,
  fn_peak_N REAL, ft_peak_N REAL,
  major_peak_1_N REAL, major_peak_2_N REAL, major_peak_3_N REAL,
  major_peak_1_t_s REAL, major_peak_2_t_s REAL, major_peak_3_t_s REAL,
  impulse_n_Ns REAL, impulse_t_Ns REAL, slide_m REAL, vt_out_m_s REAL, vn_out_m_s REAL,
  mode TEXT, major_mode TEXT, margin REAL, margin_event TEXT, stick_total_s REAL,
  kinetic_in_J REAL, friction_J REAL, restitution_J REAL, kinetic_change_J REAL, strain_change_J REAL,
  gravity_change_J REAL, exchanged_J REAL, closure REAL,
  mode_same INTEGER, fn_peak_error REAL, ft_peak_error REAL, duration_error REAL, stick_total_error REAL,
  slide_error REAL, impulse_n_error REAL, impulse_t_error REAL, v_out_error REAL,
  dt_s REAL, steps INTEGER, wall_s REAL,
  peaks            TEXT,          -- [[t_s, fn_N, ft_N, major], ...]
  ft_peaks         TEXT,          -- [[t_s, ft_N], ...]; NULL in a solved row: equal to t_s and ft_N in `peaks`
  phases           TEXT,          -- [t1_s, ...]: end of each phase; compression first, then alternating
  stick_intervals  TEXT,          -- [[t0_s, t1_s], ...]
  reaction_peaks   TEXT,          -- [[t_s, force_N], ...]: pin first, then the joints
  worker_id        INTEGER REFERENCES workers (worker_id), -- number of the worker; NULL: the server failed the point
  attempt          INTEGER NOT NULL, -- number of times that the point was leased until it was solved
  solved_at        TEXT NOT NULL, -- UTC, ISO 8601
  reused_from      TEXT,          -- STUDY/POINT that this result was copied from, by its name then; NULL: not a copy
  checksum         INTEGER,       -- CRC-32 of the other columns; NULL after a change by hand
  PRIMARY KEY (study_id, point),
  CHECK (length(error) <= 65536 AND length(mode) <= 65536 AND length(major_mode) <= 65536
         AND length(margin_event) <= 65536)
) STRICT, WITHOUT ROWID;

-- Completed points as ranges: points with a row, and points that `where` leaves out.
CREATE TABLE completed_ranges (
  study_id    INTEGER NOT NULL REFERENCES studies (study_id), -- number of the study
  first_point INTEGER NOT NULL, -- first point of the range
  points      INTEGER NOT NULL, -- number of points
  PRIMARY KEY (study_id, first_point)
) STRICT, WITHOUT ROWID;

-- Number of results that a study has copied from each other study.
CREATE TABLE reused_points (
  study_id    INTEGER NOT NULL REFERENCES studies (study_id), -- number of the study that has the copies
  source      TEXT NOT NULL,    -- name of the other study at the time of the copy
  points      INTEGER NOT NULL, -- number of copies
  PRIMARY KEY (study_id, source)
) STRICT, WITHOUT ROWID;

-- Deleted studies that may still have rows. The server deletes the rows in small parts, then this entry.
CREATE TABLE deletions (
  study_id    INTEGER PRIMARY KEY -- number of the study
) STRICT;

CREATE INDEX failed_points ON results (study_id, point) WHERE error IS NOT NULL;
-- For the lookup of results that another study can reuse.
CREATE INDEX solved_points ON results (model_id, H, mu, e) WHERE error IS NULL;

-- After rows were deleted by hand, makes the next server count the study's rows again.
CREATE TRIGGER row_deleted AFTER DELETE ON results
WHEN (SELECT counted FROM studies WHERE study_id = OLD.study_id)
BEGIN
  UPDATE studies SET counted = 0 WHERE study_id = OLD.study_id;
END;
