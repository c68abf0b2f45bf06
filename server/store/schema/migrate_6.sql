-- From schema version 6 to 7: models have the accuracy that chosen steps are for, and results how near
-- they came to another mode.
ALTER TABLE models ADD COLUMN tolerance REAL NOT NULL DEFAULT 1e-5;
ALTER TABLE results ADD COLUMN margin REAL;
ALTER TABLE results ADD COLUMN margin_event TEXT;
