-- Results, and what they share.

-- Words that many results have, each by a number: modes, and events near to which a contact came.
CREATE TABLE texts (
  text_id     INTEGER PRIMARY KEY,  -- its number
  text        TEXT NOT NULL UNIQUE, -- the words
  checksum    INTEGER            -- CRC-32 of the other columns
) STRICT;

-- One row for each settled point, packed: ask the view `results`, which has names, units and all that
-- follows from other tables. Outputs of a failed point are NULL and `error` says why. Outputs without
-- a unit in their name are multiples of a small one (README.md of server/store has them), whole where
-- that is finer than the result is accurate; lists are JSON arrays of such numbers.
CREATE TABLE packed_results (
  study_id         INTEGER NOT NULL REFERENCES studies (study_id), -- of which it is
  point            INTEGER NOT NULL, -- its number in the study, from 0
  model_id         INTEGER NOT NULL REFERENCES models (model_id),  -- every parameter but H, mu and e
  H                REAL NOT NULL, -- drop of the tip at touch, m; exact
  mu               REAL NOT NULL, -- coefficient of friction; exact
  e                REAL NOT NULL, -- coefficient of restitution; exact
  error            TEXT,         -- why it failed; NULL: it is solved
  fall_time        ANY,          -- 1e-9 s
  impact_x         ANY,          -- 1e-9 m
  vt_in            ANY,          -- 1e-8 m/s
  vn_in            ANY,          -- 1e-8 m/s
  duration         ANY,          -- 1e-12 s
  fn_peak          ANY,          -- 1e-5 N
  ft_peak          ANY,          -- 1e-5 N
  major_peak_1     ANY,          -- 1e-5 N
  major_peak_2     ANY,          -- 1e-5 N
  major_peak_3     ANY,          -- 1e-5 N
  major_peak_1_t   ANY,          -- 1e-12 s
  major_peak_2_t   ANY,          -- 1e-12 s
  major_peak_3_t   ANY,          -- 1e-12 s
  impulse_n        ANY,          -- 1e-9 N s
  impulse_t        ANY,          -- 1e-9 N s
  slide            ANY,          -- 1e-11 m
  vt_out           ANY,          -- 1e-8 m/s
  vn_out           ANY,          -- 1e-8 m/s
  margin           ANY,          -- 1e-9
  stick_total      ANY,          -- 1e-12 s
  kinetic_in       ANY,          -- 1e-8 J
  friction         ANY,          -- 1e-9 J
  restitution      ANY,          -- 1e-9 J
  kinetic_change   ANY,          -- 1e-9 J
  strain_change    ANY,          -- 1e-9 J
  gravity_change   ANY,          -- 1e-9 J
  exchanged        ANY,          -- 1e-9 J
  closure          ANY,          -- 1e-14
  fn_peak_error    ANY,          -- 1e-9
  ft_peak_error    ANY,          -- 1e-9
  duration_error   ANY,          -- 1e-9
  stick_total_error ANY,         -- 1e-9
  slide_error      ANY,          -- 1e-9
  impulse_n_error  ANY,          -- 1e-9
  impulse_t_error  ANY,          -- 1e-9
  v_out_error      ANY,          -- 1e-9
  dt               ANY,          -- 1e-15 s
  wall             ANY,          -- 1e-9 s
  steps            INTEGER,      -- as in runs
  mode_same        INTEGER,      -- as in runs
  mode             INTEGER REFERENCES texts (text_id), -- a text
  major_mode       INTEGER REFERENCES texts (text_id), -- a text
  margin_event     INTEGER REFERENCES texts (text_id), -- a text
  peaks            TEXT,         -- [t, fn, ft, ...] in 1e-12 s and 1e-5 N; fn of a ripple is negative
  ft_peaks         TEXT,         -- [t, ft, ...]; NULL of a solved point: t and ft of `peaks`
  -- [t, ...], the ends of all phases but the last, a compression first; the last ends with
  -- `duration`. NULL of a solved point: it has none
  phases           TEXT,
  stick_intervals  TEXT,         -- [t0, t1, ...]
  reaction_peaks   TEXT,         -- [t, force, ...]
  worker           INTEGER REFERENCES workers (worker_id),  -- NULL: the server failed the point
  attempt          INTEGER NOT NULL, -- number of the lease under which it was solved
  solved_at        ANY,          -- milliseconds since 1970; any other text as it came
  taken_from       TEXT,         -- origin_id/POINT whose result this is; NULL: it was solved for this point
  -- CRC-32 of the other columns (server/database/row_checksum.h), which `oblique check` compares with
  -- them. Whoever changes a row sets it to NULL.
  checksum         INTEGER,
  PRIMARY KEY (study_id, point)
) STRICT, WITHOUT ROWID;

-- Points that have a row or are left out by a filter, as runs of neighbours, so that a server that starts need not look at the rows.
-- Right for studies that are `counted`; it is changed together with the rows.
CREATE TABLE settled_points (
  study_id    INTEGER NOT NULL REFERENCES studies (study_id), -- whose points they are
  first_point INTEGER NOT NULL,  -- of the run
  points      INTEGER NOT NULL,  -- how many
  PRIMARY KEY (study_id, first_point)
) STRICT, WITHOUT ROWID;

-- Studies from which others have taken results over.
CREATE TABLE origins (
  origin_id   INTEGER PRIMARY KEY,  -- number of the study; where it came by a merge without it: one that none has
  name        TEXT NOT NULL      -- what the study is called, also after a rename; 'NAME (deleted)': what it was called last
) STRICT;

-- How many results a study has taken over from others.
CREATE TABLE taken_points (
  study_id    INTEGER NOT NULL REFERENCES studies (study_id), -- that has them
  origin_id   INTEGER NOT NULL REFERENCES origins (origin_id), -- the study that they come from
  points      INTEGER NOT NULL,  -- how many
  PRIMARY KEY (study_id, origin_id)
) STRICT, WITHOUT ROWID;
