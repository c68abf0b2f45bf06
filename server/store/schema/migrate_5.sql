-- From schema version 5 to 6: studies have the name of the key with which they were submitted.
ALTER TABLE studies ADD COLUMN submitted_by TEXT;
