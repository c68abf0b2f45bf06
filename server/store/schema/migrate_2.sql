-- From schema version 2 to 3: a study may mix results of several solver versions, and the starts of
-- servers are counted, so that no lease number is ever given twice.
ALTER TABLE studies ADD COLUMN mixes_versions INTEGER NOT NULL DEFAULT 0;
ALTER TABLE about ADD COLUMN starts INTEGER NOT NULL DEFAULT 0;
