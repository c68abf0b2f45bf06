-- The database is a public interface: read it with any SQLite tool while the server runs.
-- SI units, named in the columns. Times count from touch unless a name says otherwise.
-- PRAGMA application_id names the program, PRAGMA user_version the version of this schema. The views
-- are in views.sql.

-- One row. Workers know by it which database their results are meant for.
CREATE TABLE about (
  database_id TEXT NOT NULL,     -- drawn at random when the file was made
  starts      INTEGER NOT NULL DEFAULT 0  -- how often a server began to work on it
) STRICT;

CREATE TABLE studies (
  study_id    INTEGER PRIMARY KEY,
  name        TEXT NOT NULL UNIQUE,
  recipe      BLOB NOT NULL,     -- oblique.protocol.Recipe, serialised: point i is a function of it
  points      INTEGER NOT NULL,
  state       TEXT NOT NULL CHECK (state IN ('running', 'paused', 'cancelled', 'done')),
  created_at  TEXT NOT NULL,     -- UTC, ISO 8601
  changed_at  TEXT NOT NULL,     -- when `state` was last set
  priority    INTEGER NOT NULL DEFAULT 0,   -- studies of a higher one come first
  weight      REAL NOT NULL DEFAULT 1.0,    -- share of the workers among studies of one priority
  mixes_versions INTEGER NOT NULL DEFAULT 0, -- 1: results of several solver versions are allowed
  checksum    INTEGER            -- CRC-32 of study_id, name, recipe, points and created_at
) STRICT;

-- Every parameter but H, mu and e; one row for each distinct model that has results. The columns
-- are the model keys of study files, in SI units.
CREATE TABLE models (
  model_id    INTEGER PRIMARY KEY,
  links       INTEGER NOT NULL,
  length      REAL,              -- of every link; NULL where they differ
  lengths_m   TEXT NOT NULL,     -- JSON array, one a link, from the pin outwards
  E           REAL NOT NULL,
  A           REAL NOT NULL,
  I           REAL NOT NULL,
  rho         REAL NOT NULL,
  g           REAL NOT NULL,
  elements_per_link INTEGER NOT NULL,
  k           REAL NOT NULL,
  eta2        REAL NOT NULL,
  tip_mass    REAL NOT NULL,
  integrator  TEXT NOT NULL,
  spectral_radius REAL NOT NULL, -- of generalized-alpha
  dt          REAL NOT NULL,     -- 0: chosen for the integrator
  dt_fall     REAL NOT NULL,     -- 0: chosen for the integrator
  -- All of them as one text, by which models are told apart: 'oblique-model-1 lengths=0.4,0.4,0.4 E=7e+10
  -- A=0.0005309 ...'. proto/recipe/README.md gives it byte by byte.
  definition  TEXT NOT NULL UNIQUE
) STRICT;

-- One row for each session of a worker in which it delivered a result.
CREATE TABLE workers (
  worker_id       INTEGER PRIMARY KEY,
  name            TEXT NOT NULL,
  threads         INTEGER NOT NULL,
  solver_version  TEXT NOT NULL,
  instruction_set TEXT NOT NULL,
  joined_at       TEXT NOT NULL
) STRICT;

-- One row for each settled point. Outputs of a failed point are NULL and `error` says why.
CREATE TABLE results (
  study_id         INTEGER NOT NULL REFERENCES studies (study_id),
  point            INTEGER NOT NULL,
  model_id         INTEGER NOT NULL REFERENCES models (model_id),
  H                REAL NOT NULL,
  mu               REAL NOT NULL,
  e                REAL NOT NULL,
  status           TEXT NOT NULL CHECK (status IN ('solved', 'failed')),
  error            TEXT,
  fall_time_s      REAL,
  impact_x_m       REAL,
  vt_in_m_s        REAL,
  vn_in_m_s        REAL,
  duration_s       REAL,
  fn_peak_N        REAL,
  ft_peak_N        REAL,
  impulse_n_Ns     REAL,
  impulse_t_Ns     REAL,
  slide_m          REAL,
  vt_out_m_s       REAL,
  vn_out_m_s       REAL,
  mode             TEXT,
  major_mode       TEXT,
  stick_total_s    REAL,
  peaks            TEXT,         -- JSON [[t_s, fn_N, ft_N, major], ...], major 1 or 0
  ft_peaks         TEXT,         -- JSON [[t_s, ft_N], ...]
  phases           TEXT,         -- JSON [["compression", t0_s, t1_s], ...]
  stick_intervals  TEXT,         -- JSON [[t0_s, t1_s], ...]
  kinetic_in_J     REAL,
  friction_J       REAL,
  restitution_J    REAL,
  kinetic_change_J REAL,
  strain_change_J  REAL,
  gravity_change_J REAL,
  exchanged_J      REAL,
  closure          REAL,
  dt_s             REAL,
  steps            INTEGER,
  wall_s           REAL,
  worker           INTEGER REFERENCES workers (worker_id),  -- NULL: the server failed the point
  solver_version   TEXT,
  instruction_set  TEXT,
  attempt          INTEGER NOT NULL,
  solved_at        TEXT NOT NULL,
  -- Largest force on the outer link at the pin O, then at each joint: JSON [[t_s, force_N], ...].
  -- NULL: the row is of an earlier schema or worker.
  reaction_peaks   TEXT,
  -- CRC-32 of the other columns (server/database/row_checksum.h), which `oblique check` compares with them.
  -- NULL: the row is of an earlier schema. Whoever changes a row sets it to NULL.
  checksum         INTEGER,
  UNIQUE (study_id, point)
) STRICT;

-- Failed points that were forgotten to be solved again: runs of neighbours that had failed in one
-- attempt. Where several rows name a point the last one counts.
CREATE TABLE retries (
  study_id    INTEGER NOT NULL REFERENCES studies (study_id),
  first_point INTEGER NOT NULL,
  points      INTEGER NOT NULL,
  attempt     INTEGER NOT NULL,  -- that failed; the next one has a higher number
  retried_at  TEXT NOT NULL
) STRICT;

CREATE INDEX failed_points ON results (study_id, point) WHERE status = 'failed';
-- The views of the database, made anew after each migration. Those that users add stay.
DROP VIEW IF EXISTS runs;
DROP VIEW IF EXISTS reaction_peaks;
DROP VIEW IF EXISTS stick_intervals;
DROP VIEW IF EXISTS phases;
DROP VIEW IF EXISTS peaks;

-- The packed arrays as rows; `seq` counts from 0.
CREATE VIEW peaks AS
SELECT r.study_id AS study_id, r.point AS point, item.key AS seq,
       json_extract(item.value, '$[0]') AS t_s,
       json_extract(item.value, '$[1]') AS fn_N,
       json_extract(item.value, '$[2]') AS ft_N,
       json_extract(item.value, '$[3]') AS major
FROM results AS r, json_each(r.peaks) AS item;

CREATE VIEW phases AS
SELECT r.study_id AS study_id, r.point AS point, item.key AS seq,
       json_extract(item.value, '$[0]') AS kind,
       json_extract(item.value, '$[1]') AS t0_s,
       json_extract(item.value, '$[2]') AS t1_s
FROM results AS r, json_each(r.phases) AS item;

CREATE VIEW stick_intervals AS
SELECT r.study_id AS study_id, r.point AS point, item.key AS seq,
       json_extract(item.value, '$[0]') AS t0_s,
       json_extract(item.value, '$[1]') AS t1_s
FROM results AS r, json_each(r.stick_intervals) AS item;

-- `seq` 0 is the pin O, 1 the first joint from there.
CREATE VIEW reaction_peaks AS
SELECT r.study_id AS study_id, r.point AS point, item.key AS seq,
       json_extract(item.value, '$[0]') AS t_s,
       json_extract(item.value, '$[1]') AS force_N
FROM results AS r, json_each(r.reaction_peaks) AS item;

-- For people: study name, outputs and model beside each other. Young's modulus is E_Pa here, for
-- column names do not tell E from e.
CREATE VIEW runs AS
SELECT s.name AS study, r.study_id AS study_id, r.point AS point, r.H AS H, r.mu AS mu, r.e AS e,
       r.status AS status, r.error AS error, r.fall_time_s AS fall_time_s,
       r.impact_x_m AS impact_x_m, r.vt_in_m_s AS vt_in_m_s, r.vn_in_m_s AS vn_in_m_s,
       r.duration_s AS duration_s, r.fn_peak_N AS fn_peak_N, r.ft_peak_N AS ft_peak_N,
       r.impulse_n_Ns AS impulse_n_Ns, r.impulse_t_Ns AS impulse_t_Ns, r.slide_m AS slide_m,
       r.vt_out_m_s AS vt_out_m_s, r.vn_out_m_s AS vn_out_m_s, r.mode AS mode,
       r.major_mode AS major_mode, r.stick_total_s AS stick_total_s, r.peaks AS peaks,
       r.ft_peaks AS ft_peaks, r.phases AS phases, r.stick_intervals AS stick_intervals,
       r.reaction_peaks AS reaction_peaks,
       r.kinetic_in_J AS kinetic_in_J, r.friction_J AS friction_J,
       r.restitution_J AS restitution_J, r.kinetic_change_J AS kinetic_change_J,
       r.strain_change_J AS strain_change_J, r.gravity_change_J AS gravity_change_J,
       r.exchanged_J AS exchanged_J, r.closure AS closure, r.dt_s AS dt_s, r.steps AS steps,
       r.wall_s AS wall_s, r.worker AS worker, w.name AS worker_name,
       r.solver_version AS solver_version, r.instruction_set AS instruction_set,
       r.attempt AS attempt, r.solved_at AS solved_at, r.model_id AS model_id, m.links AS links,
       m.length AS length, m.lengths_m AS lengths_m, m.E AS E_Pa, m.A AS A, m.I AS I, m.rho AS rho,
       m.g AS g, m.elements_per_link AS elements_per_link, m.k AS k, m.eta2 AS eta2,
       m.tip_mass AS tip_mass, m.integrator AS integrator,
       m.spectral_radius AS spectral_radius, m.dt AS dt, m.dt_fall AS dt_fall
FROM results AS r
JOIN studies AS s ON s.study_id = r.study_id
JOIN models AS m ON m.model_id = r.model_id
LEFT JOIN workers AS w ON w.worker_id = r.worker;
