-- The database is a public interface: read it with any SQLite tool while the server runs.
-- SI units, named in the columns. Times count from touch unless a name says otherwise.
-- PRAGMA application_id names the program, PRAGMA user_version the version of this schema. What people
-- ask is in the views (views.sql): `runs`, `results`, `peaks`, `phases`, `stick_intervals` and
-- `reaction_peaks`. The tables of results are in results.sql.

-- One row. Workers know by it which database their results are meant for.
CREATE TABLE about (
  database_id TEXT NOT NULL,     -- drawn at random when the file was made
  starts      INTEGER NOT NULL DEFAULT 0, -- how often a server began to work on it
  last_study_id INTEGER NOT NULL DEFAULT 0  -- highest number of a study that was deleted: none gets it again
) STRICT;

CREATE TABLE studies (
  study_id    INTEGER PRIMARY KEY,  -- its number
  name        TEXT NOT NULL UNIQUE, -- by which people know it
  recipe      BLOB NOT NULL,     -- oblique.protocol.Recipe, serialised: point i is a function of it
  points      INTEGER NOT NULL,     -- how many it has, also those that filters leave out
  state       TEXT NOT NULL CHECK (state IN ('running', 'paused', 'cancelled', 'done')), -- what becomes of it
  created_at  TEXT NOT NULL,     -- UTC, ISO 8601
  changed_at  TEXT NOT NULL,     -- when `state` was last set
  priority    INTEGER NOT NULL DEFAULT 0,   -- studies of a higher one come first
  weight      REAL NOT NULL DEFAULT 1.0,    -- share of the workers among studies of one priority
  mixes_versions INTEGER NOT NULL DEFAULT 0, -- 1: results of several solver versions are allowed
  checksum    INTEGER,           -- CRC-32 of study_id, name, recipe, points and created_at
  submitted_by TEXT,             -- name of the key with which it was first submitted; NULL: without keys
  counted     INTEGER NOT NULL DEFAULT 0,   -- 1: `settled_points` says which points are settled
  left_out    INTEGER NOT NULL DEFAULT 0,   -- points of these that a filter leaves out
  takes_over  INTEGER NOT NULL DEFAULT 0    -- 1: points that other studies have solved are still sought
) STRICT;

-- Every parameter but H, mu and e; one row for each distinct model that has results. The columns
-- are the model keys of study files, in SI units.
CREATE TABLE models (
  model_id    INTEGER PRIMARY KEY, -- its number
  links       INTEGER NOT NULL,    -- number of links
  length      REAL,              -- of every link, m; NULL where they differ
  lengths_m   TEXT NOT NULL,     -- lengths in m as a JSON array, one a link, from the pin outwards
  E           REAL NOT NULL,     -- Young's modulus, Pa
  A           REAL NOT NULL,     -- cross-section area, m^2
  I           REAL NOT NULL,     -- second moment of area, m^4
  rho         REAL NOT NULL,     -- density, kg/m^3
  g           REAL NOT NULL,     -- gravity, downwards, m/s^2
  elements_per_link INTEGER NOT NULL, -- elements a link
  k           REAL NOT NULL,     -- normal contact stiffness in compression, N/m
  eta2        REAL NOT NULL,     -- ratio of normal to tangential contact stiffness
  tip_mass    REAL NOT NULL,     -- point mass at the tip, kg
  integrator  TEXT NOT NULL,     -- explicit or generalized-alpha
  spectral_radius REAL NOT NULL, -- spectral radius of generalized-alpha
  dt          REAL NOT NULL,     -- step in contact, s; 0: chosen for the integrator
  dt_fall     REAL NOT NULL,     -- step in the fall, s; 0: chosen for the integrator
  -- All of them as one text, by which models are told apart: 'oblique-model-1 lengths=0.4,0.4,0.4 E=7e+10
  -- A=0.0005309 ...'. proto/recipe/README.md gives it byte by byte.
  definition  TEXT NOT NULL UNIQUE,
  tolerance   REAL NOT NULL      -- relative error that chosen steps leave
) STRICT;

-- One row for each session of a worker in which it delivered a result.
CREATE TABLE workers (
  worker_id       INTEGER PRIMARY KEY, -- its number
  name            TEXT NOT NULL,       -- host and process, for people
  threads         INTEGER NOT NULL,    -- on how many it solves
  solver_version  TEXT NOT NULL,       -- of all its results
  instruction_set TEXT NOT NULL,       -- vector instructions that it uses
  joined_at       TEXT NOT NULL,       -- UTC, ISO 8601
  checksum        INTEGER        -- CRC-32 of the other columns
) STRICT;

-- Studies that are deleted. A server deletes their rows while it works, and the next one what no row refers to then.
CREATE TABLE deletions (
  study_id    INTEGER PRIMARY KEY   -- its number
) STRICT;

-- Failed points that were forgotten to be solved again: runs of neighbours that had failed in one
-- attempt. Where several rows name a point the last one counts.
CREATE TABLE retries (
  study_id    INTEGER NOT NULL REFERENCES studies (study_id), -- whose points they are
  first_point INTEGER NOT NULL,  -- of the run
  points      INTEGER NOT NULL,  -- how many
  attempt     INTEGER NOT NULL,  -- that failed; the next one has a higher number
  retried_at  TEXT NOT NULL      -- UTC, ISO 8601
) STRICT;
