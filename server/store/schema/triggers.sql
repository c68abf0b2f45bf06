-- The indices and the triggers of the database, created at each start of a server, after the views.

CREATE INDEX IF NOT EXISTS failed_points ON packed_results (study_id, point) WHERE error IS NOT NULL;

-- Finds the result of a point that another study needs too.
CREATE INDEX IF NOT EXISTS solved_points ON packed_results (model_id, H, mu, e) WHERE error IS NULL;

-- Rows that go, by whatever hand: the next start of a server counts again. A program that takes them
-- out of `settled_points` too sets `counted` to what it was.
-- Without the trigger, deletions by other programs were not noted.
UPDATE studies SET counted = 0
WHERE NOT EXISTS (SELECT 1 FROM sqlite_schema WHERE type = 'trigger' AND name = 'rows_are_gone');
DROP TRIGGER IF EXISTS rows_are_gone;
CREATE TRIGGER rows_are_gone AFTER DELETE ON packed_results
WHEN (SELECT counted FROM studies WHERE study_id = OLD.study_id)
BEGIN
  UPDATE studies SET counted = 0 WHERE study_id = OLD.study_id;
END;

-- Rows may be deleted by hand, and a checksum set to NULL.
CREATE TRIGGER delete_results INSTEAD OF DELETE ON results
BEGIN
  DELETE FROM packed_results WHERE study_id = OLD.study_id AND point = OLD.point;
END;

CREATE TRIGGER update_results INSTEAD OF UPDATE ON results
BEGIN
  SELECT RAISE(ABORT, 'only the checksum of results can be changed; the rest stands in packed_results')
  WHERE (NEW.study_id, NEW.point, NEW.model_id, NEW.H, NEW.mu, NEW.e, NEW.status, NEW.error,
         NEW.fall_time_s, NEW.impact_x_m, NEW.vt_in_m_s, NEW.vn_in_m_s, NEW.duration_s, NEW.fn_peak_N,
         NEW.ft_peak_N, NEW.major_peak_1_N, NEW.major_peak_2_N, NEW.major_peak_3_N,
         NEW.major_peak_1_t_s, NEW.major_peak_2_t_s, NEW.major_peak_3_t_s, NEW.impulse_n_Ns, NEW.impulse_t_Ns, NEW.slide_m, NEW.vt_out_m_s, NEW.vn_out_m_s,
         NEW.mode, NEW.major_mode, NEW.stick_total_s, NEW.peaks, NEW.ft_peaks, NEW.phases,
         NEW.stick_intervals, NEW.kinetic_in_J, NEW.friction_J, NEW.restitution_J, NEW.kinetic_change_J,
         NEW.strain_change_J, NEW.gravity_change_J, NEW.exchanged_J, NEW.closure, NEW.dt_s, NEW.steps,
         NEW.wall_s, NEW.worker, NEW.solver_version, NEW.instruction_set, NEW.attempt, NEW.solved_at,
         NEW.reaction_peaks, NEW.margin, NEW.margin_event, NEW.mode_same, NEW.fn_peak_error,
         NEW.ft_peak_error, NEW.duration_error, NEW.stick_total_error, NEW.slide_error,
         NEW.impulse_n_error, NEW.impulse_t_error, NEW.v_out_error, NEW.taken_from)
    IS NOT (OLD.study_id, OLD.point, OLD.model_id, OLD.H, OLD.mu, OLD.e, OLD.status, OLD.error,
            OLD.fall_time_s, OLD.impact_x_m, OLD.vt_in_m_s, OLD.vn_in_m_s, OLD.duration_s,
            OLD.fn_peak_N, OLD.ft_peak_N, OLD.major_peak_1_N, OLD.major_peak_2_N,
            OLD.major_peak_3_N, OLD.major_peak_1_t_s, OLD.major_peak_2_t_s, OLD.major_peak_3_t_s,
            OLD.impulse_n_Ns, OLD.impulse_t_Ns, OLD.slide_m,
            OLD.vt_out_m_s, OLD.vn_out_m_s, OLD.mode, OLD.major_mode, OLD.stick_total_s, OLD.peaks,
            OLD.ft_peaks, OLD.phases, OLD.stick_intervals, OLD.kinetic_in_J, OLD.friction_J,
            OLD.restitution_J, OLD.kinetic_change_J, OLD.strain_change_J, OLD.gravity_change_J,
            OLD.exchanged_J, OLD.closure, OLD.dt_s, OLD.steps, OLD.wall_s, OLD.worker,
            OLD.solver_version, OLD.instruction_set, OLD.attempt, OLD.solved_at, OLD.reaction_peaks,
            OLD.margin, OLD.margin_event, OLD.mode_same, OLD.fn_peak_error, OLD.ft_peak_error,
            OLD.duration_error, OLD.stick_total_error, OLD.slide_error, OLD.impulse_n_error,
            OLD.impulse_t_error, OLD.v_out_error, OLD.taken_from);
  UPDATE packed_results SET checksum = NEW.checksum
  WHERE study_id = OLD.study_id AND point = OLD.point;
END;
