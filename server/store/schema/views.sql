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
       r.reaction_peaks AS reaction_peaks, r.margin AS margin, r.margin_event AS margin_event,
       r.kinetic_in_J AS kinetic_in_J, r.friction_J AS friction_J,
       r.restitution_J AS restitution_J, r.kinetic_change_J AS kinetic_change_J,
       r.strain_change_J AS strain_change_J, r.gravity_change_J AS gravity_change_J,
       r.exchanged_J AS exchanged_J, r.closure AS closure, r.mode_same AS mode_same,
       r.fn_peak_error AS fn_peak_error, r.ft_peak_error AS ft_peak_error,
       r.duration_error AS duration_error, r.stick_total_error AS stick_total_error,
       r.slide_error AS slide_error, r.impulse_n_error AS impulse_n_error,
       r.impulse_t_error AS impulse_t_error, r.v_out_error AS v_out_error, r.dt_s AS dt_s,
       r.steps AS steps,
       r.wall_s AS wall_s, r.worker AS worker, w.name AS worker_name,
       r.solver_version AS solver_version, r.instruction_set AS instruction_set,
       r.attempt AS attempt, r.solved_at AS solved_at, r.model_id AS model_id, m.links AS links,
       m.length AS length, m.lengths_m AS lengths_m, m.E AS E_Pa, m.A AS A, m.I AS I, m.rho AS rho,
       m.g AS g, m.elements_per_link AS elements_per_link, m.k AS k, m.eta2 AS eta2,
       m.tip_mass AS tip_mass, m.integrator AS integrator,
       m.spectral_radius AS spectral_radius, m.dt AS dt, m.dt_fall AS dt_fall,
       m.tolerance AS tolerance
FROM results AS r
JOIN studies AS s ON s.study_id = r.study_id
JOIN models AS m ON m.model_id = r.model_id
LEFT JOIN workers AS w ON w.worker_id = r.worker;
