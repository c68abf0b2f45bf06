-- From schema version 6 to 7: models have the accuracy that chosen steps are for, and results how near
-- they came to another mode, and estimates of their errors.
ALTER TABLE models ADD COLUMN tolerance REAL NOT NULL DEFAULT 1e-5;
ALTER TABLE results ADD COLUMN margin REAL;
ALTER TABLE results ADD COLUMN margin_event TEXT;
ALTER TABLE results ADD COLUMN mode_same INTEGER;
ALTER TABLE results ADD COLUMN fn_peak_error REAL;
ALTER TABLE results ADD COLUMN ft_peak_error REAL;
ALTER TABLE results ADD COLUMN duration_error REAL;
ALTER TABLE results ADD COLUMN stick_total_error REAL;
ALTER TABLE results ADD COLUMN slide_error REAL;
ALTER TABLE results ADD COLUMN impulse_n_error REAL;
ALTER TABLE results ADD COLUMN impulse_t_error REAL;
ALTER TABLE results ADD COLUMN v_out_error REAL;
