-- From schema version 4 to 5: the definition of a model is its canonical text and no longer a message.
-- A column's type cannot be altered, so the table is made anew. The views name it, and must not be looked
-- at meanwhile. `model_definition` is a function of the program.
PRAGMA legacy_alter_table = ON;

CREATE TABLE models_5 (
  model_id    INTEGER PRIMARY KEY,
  links       INTEGER NOT NULL,
  length      REAL,
  lengths_m   TEXT NOT NULL,
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
  spectral_radius REAL NOT NULL,
  dt          REAL NOT NULL,
  dt_fall     REAL NOT NULL,
  definition  TEXT NOT NULL UNIQUE
) STRICT;
INSERT INTO models_5
SELECT model_id, links, length, lengths_m, E, A, I, rho, g, elements_per_link, k, eta2, tip_mass,
       integrator, spectral_radius, dt, dt_fall, model_definition(definition)
FROM models WHERE true ORDER BY model_id
ON CONFLICT (definition) DO NOTHING;

-- Models that differed in the sign of a zero are one now; a row that is changed has no checksum.
UPDATE results SET checksum = NULL, model_id =
  (SELECT kept.model_id FROM models AS lost
   JOIN models_5 AS kept ON kept.definition = model_definition(lost.definition)
   WHERE lost.model_id = results.model_id)
WHERE (SELECT count(*) FROM models) > (SELECT count(*) FROM models_5)
  AND model_id IN (SELECT model_id FROM models EXCEPT SELECT model_id FROM models_5);

DROP TABLE models;
ALTER TABLE models_5 RENAME TO models;

PRAGMA legacy_alter_table = OFF;
